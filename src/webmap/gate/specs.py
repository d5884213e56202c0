"""Checks the declaration of a robot, and puts its names in one form."""

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.outline import why_no_outline
from webmap.gate.protocol import AssistSpec, RobotSpec, StopHook
from webmap.ros.names import (
    has_gate,
    is_type,
    normalise_topic,
    normalise_url,
    same_type,
    split_type,
)

if TYPE_CHECKING:
    from webmap.gate.events import Key


TYPES = {
    "twist_topic": ("geometry_msgs/Twist", "geometry_msgs/TwistStamped"),
    "goal_topic": ("geometry_msgs/PoseStamped",),
    "action": ("nav2_msgs/NavigateToPose", "move_base_msgs/MoveBaseAction"),
    "pose_topic": ("geometry_msgs/PoseWithCovarianceStamped",),
}
"""The types that a topic or an action may have which is written to."""

SENT = {
    "twist_topic": "velocity is sent as",
    "goal_topic": "goals are sent as",
    "action": "goals are sent to actions of type",
    "pose_topic": "its initial pose is sent as",
}
"""What is sent to them, for errors."""

LEAST = {
    "v_max": 0.0,
    "w_max": 0.0,
    "z_max": 1e-3,
    "rx_max": 1e-3,
    "ry_max": 1e-3,
    "a_max": 1e-3,
    "check_every": 1.0,
    "stops_within": 0.0,
}
"""The least value of each number that a robot may have."""

TOPICS = (
    "twist_topic",
    "odometry_topic",
    "goal_topic",
    "cancel_topic",
    "action",
    "pose_topic",
)
"""The fields with the name of a topic or an action."""


def checked(spec: RobotSpec) -> RobotSpec:
    """Return ``spec`` with its addresses and topics resolved.

    Raises:
        ConfigError: If a value is invalid.

    """
    if not spec.id or len(spec.id) > 64 or not spec.id.isprintable() or spec.id == "*":
        raise ConfigError(f"a robot's id is a short plain text, got {spec.id!r}")
    try:
        return _checked(spec)
    except ConfigError as error:
        raise ConfigError(f"robot {spec.name!r}: {error}") from None


def _checked(spec: RobotSpec) -> RobotSpec:
    for place, types in TYPES.items():
        got = getattr(spec, place.removesuffix("_topic") + "_type")
        if getattr(spec, place) and not is_type(got, *types):
            raise ConfigError(f"{SENT[place]} {' or '.join(types)}, got {got!r}")
    if not all(math.isfinite(v) and v >= 0 for v in spec.pose_covariance):
        raise ConfigError(
            "the covariance of its initial pose is made of numbers from 0 on, got "
            f"{spec.pose_covariance}"
        )
    if not all(map(math.isfinite, spec.own_map)):
        raise ConfigError(
            f"its own map lies on the common one by finite numbers, got {spec.own_map}"
        )
    if spec.odometry_type:
        split_type(spec.odometry_type)
    url = normalise_url(spec.bridge_url)
    for each in (url, spec.goal_url or url):
        if not has_gate(each):
            raise ConfigError(
                f"the gate cannot move robots behind {each}; they can only be watched"
            )
    numbers = {}
    for field, least in LEAST.items():
        number = getattr(spec, field)
        if number is not None:
            numbers[field] = float(number)
            if not least <= number < math.inf:
                expected = f"expected a number from {least:g} on"
                raise ConfigError(f"{field} is {number}, {expected}")
    topics = {field: getattr(spec, field) for field in TOPICS}
    return msgspec.structs.replace(
        spec,
        bridge_url=url,
        odometry_url=normalise_url(spec.odometry_url) if spec.odometry_url else url,
        goal_url=normalise_url(spec.goal_url) if spec.goal_url else url,
        **numbers,
        **{key: normalise_topic(v) if v else None for key, v in topics.items()},
        assist=spec.assist and _checked_assist(spec.assist),
        stop_hooks=tuple(_checked_hook(h, spec.twist_topic) for h in spec.stop_hooks),
    )


def _checked_hook(hook: StopHook, twist_topic: str | None) -> StopHook:
    """Return a stop hook with its name resolved; it never writes to ``twist_topic``."""
    if bool(hook.topic) == bool(hook.service):
        raise ConfigError(f"a stop hook has either a topic or a service, got {hook}")
    place, type = "service", "std_srvs/Trigger"
    if hook.topic:
        place, type = "topic", "std_msgs/Bool"
    if hook.type and not is_type(hook.type, type):
        raise ConfigError(
            f"the {place} of a stop hook is of type {type}, got {hook.type!r}"
        )
    resolved = normalise_topic(hook.name)
    if twist_topic and resolved == normalise_topic(twist_topic):
        raise ConfigError(
            f"{resolved} is the velocity topic, which cannot be a stop hook"
        )
    return StopHook(**{place: resolved, "type": hook.type or type})


def _checked_assist(assist: AssistSpec) -> AssistSpec:
    """Return scan assist with its topic resolved."""
    numbers = [n for corner in assist.footprint for n in corner]
    numbers += [*assist.sensor, assist.stop_distance, assist.brake, assist.creep]
    if not all(map(math.isfinite, numbers)):
        raise ConfigError("scan assist needs finite numbers")
    if why := why_no_outline(assist.footprint):
        raise ConfigError(f"the footprint for scan assist: {why}")
    if assist.stop_distance < 0 or assist.brake <= 0 or assist.creep < 0:
        raise ConfigError(
            "scan assist needs a stop distance and a creep speed from 0 on, and a "
            "brake above 0"
        )
    if assist.blind not in ("stop", "creep"):
        raise ConfigError(
            "what a robot does without a usable scan is 'stop' or 'creep', got "
            f"{assist.blind!r}"
        )
    x, y, yaw = map(float, assist.sensor)
    return msgspec.structs.replace(
        assist,
        topic=normalise_topic(assist.topic),
        footprint=tuple((float(x), float(y)) for x, y in assist.footprint),
        sensor=(x, y, yaw),
        stop_distance=float(assist.stop_distance),
        brake=float(assist.brake),
        creep=float(assist.creep),
    )


def check_twist_type(spec: RobotSpec, others: Iterable[RobotSpec]) -> None:
    """Check that the velocity topic of a checked ``spec`` has one type for all robots.

    Raises:
        ConfigError: If another robot states another type for that topic.

    """
    if spec.twist_topic is None or spec.twist_type_assumed:
        return
    for other in others:
        if (
            other.id != spec.id
            and not other.twist_type_assumed
            and key_of(other) == key_of(spec)
            and not same_type(other.twist_type, spec.twist_type)
        ):
            raise ConfigError(
                f"robot {spec.name!r}: got {spec.twist_type} for {spec.twist_topic}, "
                f"but robot {other.name!r} uses {other.twist_type} for this topic"
            )


def key_of(spec: RobotSpec) -> "Key":
    """Return the key of the machine of a checked ``spec``.

    A robot without a velocity topic has the place of its goals as its key.
    """
    from webmap.gate.events import Key  # the display checks specs without the events

    if spec.twist_topic is not None:
        return Key(spec.bridge_url, spec.twist_topic)
    goal = spec.goal_topic or spec.action or f"robot {spec.id}"
    return Key(spec.goal_url or spec.bridge_url, f"goal {goal}")
