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


def checked_hook(name: str, hook: StopHook, twist_topic: str | None) -> StopHook:
    """Return a stop hook of the robot called ``name``, with its name resolved.

    Args:
        name: The name of the robot, for errors.
        hook: The hook.
        twist_topic: The velocity topic, which no hook may write to.

    Raises:
        ConfigError: If the hook is invalid.

    """
    if bool(hook.topic) == bool(hook.service):
        raise ConfigError(
            f"robot {name!r}: a stop hook has either a topic or a service, got {hook}"
        )
    place, type = "service", "std_srvs/Trigger"
    if hook.topic:
        place, type = "topic", "std_msgs/Bool"
    if hook.type and not is_type(hook.type, type):
        raise ConfigError(
            f"robot {name!r}: the {place} of a stop hook is of type {type}, "
            f"got {hook.type!r}"
        )
    resolved = normalise_topic(hook.name)
    if twist_topic and resolved == normalise_topic(twist_topic):
        raise ConfigError(
            f"robot {name!r}: {resolved} is the velocity topic, "
            "which cannot be a stop hook"
        )
    return StopHook(**{place: resolved, "type": hook.type or type})


ACTIONS = ("nav2_msgs/NavigateToPose", "move_base_msgs/MoveBaseAction")
"""The types of actions that take goals."""

POSE_TYPE = "geometry_msgs/PoseWithCovarianceStamped"


def checked(spec: RobotSpec) -> RobotSpec:
    """Return ``spec`` with its addresses and topics resolved.

    Raises:
        ConfigError: If a value is invalid.

    """
    if not spec.id or len(spec.id) > 64 or not spec.id.isprintable() or spec.id == "*":
        raise ConfigError(f"a robot's id is a short plain text, got {spec.id!r}")
    if spec.twist_topic and not is_type(
        spec.twist_type, "geometry_msgs/Twist", "geometry_msgs/TwistStamped"
    ):
        raise ConfigError(
            f"robot {spec.name!r}: velocity is sent as geometry_msgs/Twist or "
            f"TwistStamped, got {spec.twist_type!r}"
        )
    if spec.goal_topic and not is_type(spec.goal_type, "geometry_msgs/PoseStamped"):
        raise ConfigError(
            f"robot {spec.name!r}: goals are sent as geometry_msgs/PoseStamped, "
            f"got {spec.goal_type!r}"
        )
    if spec.action and not is_type(spec.action_type, *ACTIONS):
        raise ConfigError(
            f"robot {spec.name!r}: goals are sent to actions of type "
            f"{' or '.join(ACTIONS)}, got {spec.action_type!r}"
        )
    if spec.pose_topic and not is_type(spec.pose_type, POSE_TYPE):
        raise ConfigError(
            f"robot {spec.name!r}: its initial pose is sent as {POSE_TYPE}, "
            f"got {spec.pose_type!r}"
        )
    if not all(math.isfinite(v) and v >= 0 for v in spec.pose_covariance):
        raise ConfigError(
            f"robot {spec.name!r}: the covariance of its initial pose is made of "
            f"numbers from 0 on, got {spec.pose_covariance}"
        )
    if not all(map(math.isfinite, spec.own_map)):
        raise ConfigError(
            f"robot {spec.name!r}: its own map lies on the common one by finite "
            f"numbers, got {spec.own_map}"
        )
    if spec.odometry_type:
        split_type(spec.odometry_type)
    url = normalise_url(spec.bridge_url)
    for each in (url, spec.goal_url or url):
        if not has_gate(each):
            raise ConfigError(
                f"robot {spec.name!r}: the gate cannot move robots behind {each}; they "
                "can only be watched"
            )
    return msgspec.structs.replace(
        spec,
        bridge_url=url,
        odometry_url=normalise_url(spec.odometry_url) if spec.odometry_url else url,
        goal_url=normalise_url(spec.goal_url) if spec.goal_url else url,
        twist_topic=_topic(spec.twist_topic),
        odometry_topic=_topic(spec.odometry_topic),
        goal_topic=_topic(spec.goal_topic),
        cancel_topic=_topic(spec.cancel_topic),
        action=_topic(spec.action),
        pose_topic=_topic(spec.pose_topic),
        v_max=_number(spec, "v_max", least=0.0),
        w_max=_number(spec, "w_max", least=0.0),
        z_max=_number(spec, "z_max", least=1e-3),
        rx_max=_number(spec, "rx_max", least=1e-3),
        ry_max=_number(spec, "ry_max", least=1e-3),
        a_max=_number(spec, "a_max", least=1e-3),
        check_every=_number(spec, "check_every", least=1.0),
        stops_within=_number(spec, "stops_within", least=0.0),
        assist=spec.assist and checked_assist(spec.name, spec.assist),
        stop_hooks=tuple(
            checked_hook(spec.name, hook, spec.twist_topic) for hook in spec.stop_hooks
        ),
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


def _number(spec: RobotSpec, field: str, least: float) -> float | None:
    value = getattr(spec, field)
    if value is None:
        return None
    if not (math.isfinite(value) and value >= least):
        raise ConfigError(
            f"robot {spec.name!r}: {field} is {value}, expected a number from "
            f"{least:g} on"
        )
    return float(value)


def checked_assist(name: str, assist: AssistSpec) -> AssistSpec:
    """Return the scan assist of the robot called ``name``, with its topic resolved.

    Raises:
        ConfigError: If a value is invalid.

    """
    numbers = [n for corner in assist.footprint for n in corner]
    numbers += [*assist.sensor, assist.stop_distance, assist.brake, assist.creep]
    if not all(map(math.isfinite, numbers)):
        raise ConfigError(f"robot {name!r}: scan assist needs finite numbers")
    if why := why_no_outline(assist.footprint):
        raise ConfigError(f"robot {name!r}: the footprint for scan assist: {why}")
    if assist.stop_distance < 0 or assist.brake <= 0 or assist.creep < 0:
        raise ConfigError(
            f"robot {name!r}: scan assist needs a stop distance and a creep speed "
            "from 0 on, and a brake above 0"
        )
    if assist.blind not in ("stop", "creep"):
        raise ConfigError(
            f"robot {name!r}: what a robot does without a usable scan is 'stop' or "
            f"'creep', got {assist.blind!r}"
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


def _topic(topic: str | None) -> str | None:
    return normalise_topic(topic) if topic else None
