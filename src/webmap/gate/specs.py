"""Checks the declaration of a robot, and puts its names in one form.

:mod:`webmap.config` has the checks of its parts: the gate makes them again, because it
trusts no message.
"""

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec import structs

from webmap.base.errors import ConfigError
from webmap.config.checks import Mistakes
from webmap.config.motion import MOTION, WRITING, MotionConfig
from webmap.config.reading import read
from webmap.gate.protocol import RobotSpec
from webmap.ros.names import (
    has_gate,
    normalise_topic,
    normalise_url,
    same_type,
    split_type,
)

if TYPE_CHECKING:
    from webmap.gate.events import Key


def checked(spec: RobotSpec) -> RobotSpec:
    """Return ``spec`` with its addresses and topics resolved.

    Its parts are read as those of a fleet file are, with every check of their values.

    Raises:
        ConfigError: If a value is invalid.

    """
    if not spec.id or len(spec.id) > 64 or not spec.id.isprintable() or spec.id == "*":
        raise ConfigError(f"a robot's id is a short plain text, got {spec.id!r}")
    mistakes = Mistakes()
    given = {key: msgspec.to_builtins(getattr(spec, key)) for key in MOTION}
    motion = read(MotionConfig, given, (), mistakes)
    mistakes.refuse(f"robot {spec.name!r}")
    assert motion is not None, "it is a table"
    return resolved(structs.replace(spec, **structs.asdict(motion)))


def resolved(spec: RobotSpec) -> RobotSpec:
    """Return ``spec`` with its addresses resolved; its parts are valid.

    Raises:
        ConfigError: If the gate cannot move robots behind an address, or another value
            is invalid.

    """
    try:
        return _resolved(spec)
    except ConfigError as error:
        raise ConfigError(f"robot {spec.name!r}: {error}") from None


def _resolved(spec: RobotSpec) -> RobotSpec:
    if not all(map(math.isfinite, spec.own_map)):
        raise ConfigError(
            f"its own map lies on the common one by finite numbers, got {spec.own_map}"
        )
    if spec.odometry_type:
        split_type(spec.odometry_type)
    parts: dict[str, Any] = {}
    for key in WRITING:
        part = getattr(spec, key)
        if part is not None:
            url = normalise_url(part.bridge)
            if not has_gate(url):
                raise ConfigError(
                    f"the gate cannot move robots behind {url}; they can only be "
                    "watched"
                )
            parts[key] = structs.replace(part, bridge=url)
    if not parts:
        raise ConfigError(
            f"nothing moves it: expected one of the parts {', '.join(WRITING)}"
        )
    if spec.scan_assist is not None:  # a radius becomes corners, once
        corners = list(spec.scan_assist.corners)
        parts["scan_assist"] = structs.replace(spec.scan_assist, footprint=corners)
    spec = structs.replace(spec, **parts)
    odometry = spec.odometry_url, spec.odometry_topic
    return structs.replace(
        spec,
        odometry_url=normalise_url(odometry[0]) if odometry[0] else spec.bridge_url,
        odometry_topic=normalise_topic(odometry[1]) if odometry[1] else None,
    )


def check_twist_type(spec: RobotSpec, others: Iterable[RobotSpec]) -> None:
    """Check that the velocity topic of a checked ``spec`` has one type for all robots.

    Raises:
        ConfigError: If another robot states another type for that topic.

    """
    if spec.twist is None or spec.twist_type_assumed:
        return
    for other in others:
        if (
            other.id != spec.id
            and not other.twist_type_assumed
            and key_of(other) == key_of(spec)
            and not same_type(other.twist_type, spec.twist_type)
        ):
            raise ConfigError(
                f"robot {spec.name!r}: got {spec.twist_type} for {spec.twist.topic}, "
                f"but robot {other.name!r} uses {other.twist_type} for this topic"
            )


def key_of(spec: RobotSpec) -> "Key":
    """Return the key of the machine of a checked ``spec``.

    A robot without a velocity topic has the place of its goals as its key.
    """
    from webmap.gate.events import Key  # the display checks specs without the events

    if spec.twist is not None:
        return Key(spec.twist.bridge, spec.twist.topic)
    goal = spec.navigation.topic or spec.navigation.action or f"robot {spec.id}"
    return Key(spec.goal_url, f"goal {goal}")
