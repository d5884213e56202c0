"""The robots that somebody configured, laid over those that were found; without I/O."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from webmap.base.errors import ConfigError
from webmap.discovery.found import Findings, FoundRobot, Guess, Role
from webmap.discovery.naming import free_name
from webmap.discovery.rules import VELOCITY
from webmap.ros.names import is_type, normalise_topic
from webmap.ros.tf import Buffer

RULE = "as it was said"

TYPES: Mapping[Role, str] = {
    "odometry": "nav_msgs/Odometry",
    "velocity": VELOCITY[0],
    "scan": "sensor_msgs/LaserScan",
    "battery": "sensor_msgs/BatteryState",
    "camera": "sensor_msgs/CompressedImage",
    "cloud": "sensor_msgs/PointCloud2",
    "costmap": "nav_msgs/OccupancyGrid",
    "map": "nav_msgs/OccupancyGrid",
    "plan": "nav_msgs/Path",
    "tf": "tf2_msgs/TFMessage",
}
"""What a topic is taken to carry if neither a person nor the bridge says it."""

WHERE: tuple[Role, ...] = ("odometry", "pose")


@dataclass(frozen=True, slots=True)
class MeantRobot:
    """A robot as somebody configured it."""

    name: str
    topics: Mapping[Role, tuple[tuple[str, str], ...]] = field(default_factory=dict)
    """For each role that was said its topics, each with its type, empty if that was
    not said; no topic if the robot does without. Other roles are as they were found."""

    base_frame: str = ""
    """The frame of its base, if it is drawn by frames."""

    map_frame: str = ""
    """The frame that it is drawn in; empty if that was not said."""

    elsewhere: frozenset[Role] = frozenset()
    """What of it goes over another bridge, whose own check tells of it."""

    found_as: str = ""
    """What it is called where nobody says its name; empty if it was not found."""


def lay_over(
    findings: Findings, meant: Sequence[MeantRobot], types: Mapping[str, str]
) -> tuple[Findings, dict[str, MeantRobot]]:
    """Return what is to be measured, and how each robot was meant, by its name.

    Robots that were found and that nobody meant are not among it.

    Args:
        findings: What was found.
        meant: The robots that somebody configured, at least one.
        types: Types by topic, as the bridge or a list tells them.

    """
    taken: set[str] = set()
    robots: list[FoundRobot] = []
    by_name: dict[str, MeantRobot] = {}
    for one, there in zip(meant, _found(meant, findings.robots), strict=True):
        name = free_name(one.name, taken)
        robots.append(_laid(name, one, there, types))
        by_name[name] = replace(one, found_as="" if there is None else there.name)
    return replace(findings, robots=tuple(robots)), by_name


def _found(
    meant: Sequence[MeantRobot], robots: Sequence[FoundRobot]
) -> list[FoundRobot | None]:
    """Return for each robot that was meant the one that was found, each but once."""
    left = list(robots)
    found: list[FoundRobot | None] = [None for _ in meant]
    # A name is the weakest sign: it comes when all topics have been looked at.
    for fits in (_is_called, _has_its_topics, _has_its_name):
        for place, one in enumerate(meant):
            if found[place] is None:
                there = next((robot for robot in left if fits(one, robot)), None)
                if there is not None:
                    left.remove(there)
                    found[place] = there
    return found


def _is_called(one: MeantRobot, robot: FoundRobot) -> bool:
    return one.found_as == robot.name


def _has_its_name(one: MeantRobot, robot: FoundRobot) -> bool:
    return one.name == robot.name


def _has_its_topics(one: MeantRobot, robot: FoundRobot) -> bool:
    velocity: tuple[Role, ...] = ("velocity",)
    for alike in (WHERE, velocity):
        said = [each for role in alike for each in one.topics.get(role, ())]
        there = {each.topic for role in alike for each in robot.guesses.get(role, ())}
        if any(_plain(topic) in there for topic, _ in said):
            return True
    whole = Buffer().name(robot.base_frame, robot.tf_namespace or "")
    return whole != "" and one.base_frame == whole


def _laid(
    name: str,
    one: MeantRobot,
    there: FoundRobot | None,
    types: Mapping[str, str],
) -> FoundRobot:
    robot = FoundRobot(name, "") if there is None else replace(there, name=name)
    guesses = dict(robot.guesses)
    for role, topics in one.topics.items():
        guesses.pop(role, None)
        plain = [(_plain(topic), type) for topic, type in topics]
        if plain:
            guesses[role] = tuple(
                Guess(topic, _type(role, types.get(topic, ""), type), RULE)
                for topic, type in plain
            )
    base = one.base_frame or robot.base_frame
    return replace(robot, guesses=guesses, base_frame=base)


def _type(role: Role, behind: str, said: str) -> str:
    """Return the type that WebMap goes by: what it sends, and what it listens to."""
    behind = behind.strip()
    if role == "velocity":
        return said or (behind if is_type(behind, *VELOCITY) else TYPES[role])
    return behind or said or TYPES.get(role, "")


def _plain(topic: str) -> str:
    try:
        return normalise_topic(topic)
    except ConfigError:  # who made the robot was told so
        return topic
