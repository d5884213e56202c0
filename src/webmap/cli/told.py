"""What else a robot that was told by hand has, by the topics behind its bridge."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from webmap.cli.names import APART, check_name
from webmap.console import RobotDescription, parse_robot
from webmap.discovery import Findings, FoundRobot
from webmap.discovery.found import Role
from webmap.discovery.layers import FoundLayer, find_layers, left_out
from webmap.discovery.naming import same_name
from webmap.discovery.rules import PARTS
from webmap.errors import ConfigError
from webmap.ros.names import normalise_topic

if TYPE_CHECKING:
    from webmap import Bridge

WHERE: tuple[Role, ...] = ("odometry", "pose")

_PART = re.compile(PARTS)


def told_robots(
    texts: Iterable[str], bridges: Sequence["Bridge"], stops_within: float | None
) -> list[RobotDescription]:
    """Return the robots of ``--robot``.

    Args:
        texts: As they were written.
        bridges: The bridges there are.
        stops_within: Seconds within which every base stops by itself, if known.

    Raises:
        ConfigError: If one is not of the right form, or two are taken for one: by
            their names, or by what they are driven with.

    """
    told: list[RobotDescription] = []
    for text in texts:
        robot = parse_robot(text, bridges, stops_within=stops_within)
        check_name(robot.name, f"robot {text!r}")
        for topic in filter(None, (robot.odometry, robot.twist, robot.scan)):
            try:
                normalise_topic(topic)
            except ConfigError as error:
                raise ConfigError(f"robot {text!r}: {error}") from None
        for other in told:
            _differ(robot, other, text)
        told.append(robot)
    return told


def _differ(robot: RobotDescription, other: RobotDescription, text: str) -> None:
    if same_name(robot.name) == same_name(other.name):
        raise ConfigError(
            f"robot {text!r}: there is a robot {other.name!r} already; {APART}"
        )
    same = robot.twist and _plain(robot.twist) == _plain(other.twist or "-")
    if same and robot.bridge.url == other.bridge.url:
        raise ConfigError(
            f"robot {text!r}: {robot.twist} drives {other.name!r} already; each robot "
            "has its own"
        )


@dataclass(frozen=True, slots=True)
class Offer:
    """What can be drawn of a robot that was told."""

    found: FoundRobot | None
    """The same robot as discovery has it, if it does."""

    namespace: str
    layers: tuple[FoundLayer, ...]
    left_out: tuple[FoundLayer, ...]
    """What could be drawn too, but for its number."""


def offer(
    about: RobotDescription, topics: Mapping[str, str], findings: Findings
) -> Offer:
    """Return what can be drawn of a robot that was told.

    Scans are as they were said, so no other one is among it.

    Args:
        about: The robot.
        topics: Types by topic, behind its bridge.
        findings: What discovery makes of those.

    """
    found = same_robot(about, findings.robots)
    space = namespace_of(about) if found is None else found.namespace
    if space in findings.layers:
        layers, others = findings.layers[space], findings.left_out[space]
    else:
        spaces = {*findings.layers, space}
        layers = tuple(find_layers(topics, spaces)[space])
        others = tuple(left_out(topics, spaces)[space])
    kept = tuple(layer for layer in layers if layer.kind != "scan")
    return Offer(found, space, kept, tuple(o for o in others if o.kind != "scan"))


def same_robot(
    about: RobotDescription, robots: Iterable[FoundRobot]
) -> FoundRobot | None:
    """Return which of the robots that were found is the one that was told.

    One of its topics says so, also one that is not the best of its role; else its name.
    """
    there = tuple(robots)
    for robot in there:
        if _has(robot, WHERE, about.odometry) or _has(
            robot, ("velocity",), about.twist
        ):
            return robot
    return next((robot for robot in there if robot.name == about.name), None)


def namespace_of(about: RobotDescription) -> str:
    """Return the namespace that the topics of a robot have in common.

    Names of parts of a robot at its end belong to the part.
    """
    said = (about.odometry, about.twist, about.scan)
    spaces = [_plain(topic).split("/")[1:-1] for topic in said if topic]
    common: list[str] = []
    for names in zip(*spaces, strict=False):
        if len(set(names)) > 1:
            break
        common.append(names[0])
    while common and _PART.fullmatch(common[-1]):
        common.pop()
    return "".join(f"/{name}" for name in common)


def _has(robot: FoundRobot, roles: tuple[Role, ...], topic: str) -> bool:
    plain = _plain(topic) if topic else ""
    return plain != "" and any(
        guess.topic == plain for role in roles for guess in robot.guesses.get(role, ())
    )


def _plain(topic: str) -> str:
    try:
        return normalise_topic(topic)
    except ConfigError:  # the robot itself will say so
        return topic
