"""Stop hooks as the gate takes them: each a topic for a Bool, or a Trigger service."""

from collections.abc import Iterable, Mapping
from typing import Any

from webmap.base.errors import ConfigError
from webmap.ros.names import is_type, normalise_topic

PLACES = (("topic", "std_msgs/Bool"), ("service", "std_srvs/Trigger"))
"""What a hook may name, and of which type that is."""


def checked_hooks(
    name: str, hooks: Any, twist_topic: str | None
) -> tuple[dict[str, str], ...]:
    """Return the stop hooks of the robot called ``name``, with names resolved.

    Args:
        name: The robot, for people.
        hooks: Any number of hooks, in order.
        twist_topic: Where its velocity goes, which no hook may write to.

    Raises:
        ConfigError: If something in them cannot be meant.

    """
    if isinstance(hooks, str | Mapping) or not isinstance(hooks, Iterable):
        raise ConfigError(
            f"robot {name!r}: stop_hooks is a list of hooks, got {hooks!r}"
        )
    return tuple(_checked(name, hook, twist_topic) for hook in hooks)


def place_of(hook: Mapping[str, str]) -> tuple[str, str]:
    """Return whether a checked hook is a topic or a service, and its name."""
    place = "topic" if "topic" in hook else "service"
    return place, hook[place]


def _checked(name: str, hook: Any, twist_topic: str | None) -> dict[str, str]:
    if not isinstance(hook, Mapping):
        raise ConfigError(
            f"robot {name!r}: a stop hook is a table such as "
            f"{{'topic': '/lock', 'type': 'std_msgs/Bool'}}, got {hook!r}"
        )
    for place, type in PLACES:
        if place in hook and hook.keys() <= {place, "type"}:
            return _resolved(name, hook, place, type, twist_topic)
    raise ConfigError(
        f"robot {name!r}: a stop hook has the key 'topic' or the key 'service', and "
        f"besides 'type' no other, got {dict(hook)!r}"
    )


def _resolved(
    name: str, hook: Mapping[str, Any], place: str, type: str, twist_topic: str | None
) -> dict[str, str]:
    given = hook.get("type", type)
    if not isinstance(given, str) or not is_type(given, type):
        raise ConfigError(
            f"robot {name!r}: the {place} of a stop hook is of type {type}, "
            f"got {given!r}"
        )
    where = hook[place]
    if not isinstance(where, str) or not where:
        raise ConfigError(
            f"robot {name!r}: the {place} of a stop hook is a name such as '/lock', "
            f"got {where!r}"
        )
    resolved = normalise_topic(where)
    if twist_topic and resolved == normalise_topic(twist_topic):
        raise ConfigError(
            f"robot {name!r}: its velocity goes to {resolved}, so that is no stop hook"
        )
    return {place: resolved, "type": given}
