"""Robots given with ``--robot``, and their other topics behind the bridges."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from webmap.base.errors import ConfigError
from webmap.config.checks import LONGEST_NAME, is_name, same_name
from webmap.discovery import Findings, FoundRobot, Guess
from webmap.discovery.findings import Layers, TopicRole
from webmap.discovery.layers import find_layers
from webmap.discovery.rules import PARTS
from webmap.ros.names import normalise_topic

if TYPE_CHECKING:
    from webmap import Bridge

FORM = "NAME:ODOM:CMD_VEL:SCAN, as in Bob:/odom:/cmd_vel:/scan"

APART = "names must differ by more than case and Unicode form"

GIVEN_ROLES: tuple[TopicRole, ...] = ("odometry", "velocity", "scan")
"""The roles in a value of ``--robot``."""

POSE_ROLES: tuple[TopicRole, ...] = ("odometry", "pose")

_PART = re.compile(PARTS)


class Candidate(NamedTuple):
    """A robot, found or given with ``--robot``, and the bridge that it is behind."""

    bridge: "Bridge"
    found: FoundRobot

    def is_also(self, other: "Candidate") -> bool:
        """Return whether two candidates are one robot.

        They are if their names, odometry topics or velocity topics are equal.
        """
        if self.bridge is not other.bridge:
            return False
        mine, others = self.found, other.found
        return (
            mine.name == others.name
            or _pose_topic(mine) in ({_pose_topic(others)} - {""})
            or mine.topic("velocity") in ({others.topic("velocity")} - {""})
        )


def parse_robot(text: str, bridges: Sequence["Bridge"]) -> Candidate:
    """Read a robot from the command line.

    Args:
        text: ``NAME:ODOM:CMD_VEL:SCAN``; topics may be empty, and empty ones at the
            end may be left out. ``2@`` before the name means that the robot is behind
            the second bridge.
        bridges: All bridges.

    Raises:
        ConfigError: If the text has another form, or there is no such bridge.

    """
    number, _, rest = (
        text.rpartition("@") if "@" in text.partition(":")[0] else ("1", "", text)
    )
    if not (number.isascii() and number.isdigit() and 0 < int(number) <= len(bridges)):
        raise ConfigError(
            f"robot {text!r}: got the bridge number {number!r}, expected 1 to "
            f"{len(bridges)}"
        )
    name, *topics = (part.strip() for part in rest.split(":"))
    if not name or len(topics) > len(GIVEN_ROLES) or not any(topics):
        raise ConfigError(f"robot {text!r} is not of the form {FORM}")
    pairs = zip(GIVEN_ROLES, topics, strict=False)
    guesses = {role: (Guess(topic, "", ""),) for role, topic in pairs if topic}
    return Candidate(bridges[int(number) - 1], FoundRobot(name, "", guesses))


def check_name(name: str, where: str) -> None:
    """Refuse a name that does not fit into a list.

    Raises:
        ConfigError: If it has more than one line, or is very long.

    """
    if not is_name(name):
        raise ConfigError(
            f"{where}: a name is one line of at most {LONGEST_NAME} characters"
        )


def same_name_error(name: str) -> ConfigError:
    """Return the error for a ``--set`` that gives two robots the same name."""
    return ConfigError(f"--set: two robots would be called {name!r}; {APART}")


def parse_robots(texts: Iterable[str], bridges: Sequence["Bridge"]) -> list[Candidate]:
    """Return the robots of ``--robot``.

    Args:
        texts: The values of ``--robot``.
        bridges: All bridges.

    Raises:
        ConfigError: If one has another form, or two have the same name or the same
            velocity topic.

    """
    given: list[Candidate] = []
    for text in texts:
        robot = parse_robot(text, bridges)
        check_name(robot.found.name, f"robot {text!r}")
        for topic in _topics_of(robot.found):
            try:
                normalise_topic(topic)
            except ConfigError as error:
                raise ConfigError(f"robot {text!r}: {error}") from None
        for other in given:
            _differ(robot, other, text)
        given.append(robot)
    return given


def _differ(robot: Candidate, other: Candidate, text: str) -> None:
    name, drives = other.found.name, robot.found.topic("velocity")
    if same_name(robot.found.name) == same_name(name):
        raise ConfigError(f"robot {text!r}: another robot is called {name!r}; {APART}")
    same = drives and _plain(drives) == _plain(other.found.topic("velocity") or "-")
    if same and robot.bridge.url == other.bridge.url:
        raise ConfigError(
            f"robot {text!r}: {drives} already drives {name!r}; expected another topic"
        )


@dataclass(frozen=True, slots=True)
class DrawableTopics:
    """What discovery adds to a robot of ``--robot``: its other topics."""

    found: FoundRobot | None
    """The same robot as discovery found it, if it did."""

    namespace: str
    layers: Layers


def drawable_topics(
    given: FoundRobot, topics: Mapping[str, str], findings: Findings
) -> DrawableTopics:
    """Return the drawable topics of a robot given with ``--robot``.

    Scans are only those that were given, so the result has none.

    Args:
        given: The robot.
        topics: Types by topic, behind its bridge.
        findings: The findings of the bridge.

    """
    found = same_robot(given, findings.robots)
    space = namespace_of(given) if found is None else found.namespace
    layers = findings.layers.get(space)
    if layers is None:
        layers = find_layers(topics, {*findings.layers, space})[space]
    kept = [[layer for layer in each if layer.kind != "scan"] for each in layers]
    return DrawableTopics(found, space, Layers(*map(tuple, kept)))


def same_robot(given: FoundRobot, robots: Iterable[FoundRobot]) -> FoundRobot | None:
    """Return the found robot that is the one given with ``--robot``.

    They are the same if one of the found topics is given, also one that is not the
    best of its role; else by name.
    """
    there = tuple(robots)
    for robot in there:
        if _has(robot, POSE_ROLES, given.topic("odometry")) or _has(
            robot, ("velocity",), given.topic("velocity")
        ):
            return robot
    return next((robot for robot in there if robot.name == given.name), None)


def namespace_of(given: FoundRobot) -> str:
    """Return the common namespace of a robot's topics.

    Names of robot parts at its end belong to the part.
    """
    spaces = [_plain(topic).split("/")[1:-1] for topic in _topics_of(given)]
    common: list[str] = []
    for names in zip(*spaces, strict=False):
        if len(set(names)) > 1:
            break
        common.append(names[0])
    while common and _PART.fullmatch(common[-1]):
        common.pop()
    return "".join(f"/{name}" for name in common)


def _topics_of(given: FoundRobot) -> list[str]:
    return [given.topic(role) for role in GIVEN_ROLES if given.topic(role)]


def _pose_topic(robot: FoundRobot) -> str:
    return robot.topic("odometry") or robot.topic("pose")


def _has(robot: FoundRobot, roles: tuple[TopicRole, ...], topic: str) -> bool:
    plain = _plain(topic) if topic else ""
    return plain != "" and any(
        guess.topic == plain for role in roles for guess in robot.guesses.get(role, ())
    )


def _plain(topic: str) -> str:
    try:
        return normalise_topic(topic)
    except ConfigError:  # the robot itself reports the error
        return topic
