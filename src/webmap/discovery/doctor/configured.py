"""Combines the configured robots with those that were found; without I/O."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from webmap.base.errors import ConfigError
from webmap.discovery.found import Findings, FoundRobot, Guess, Role
from webmap.discovery.naming import free_name
from webmap.discovery.rules import VELOCITY
from webmap.ros.names import is_type, normalise_topic
from webmap.ros.tf import Buffer

RULE = "as configured"

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
"""Default types of topics, if neither the configuration nor the bridge has the type."""

WHERE: tuple[Role, ...] = ("odometry", "pose")


@dataclass(frozen=True, slots=True)
class ConfiguredRobot:
    """A robot as a person configured it."""

    name: str
    topics: Mapping[Role, tuple[tuple[str, str], ...]] = field(default_factory=dict)
    """The topics of each configured role with their types; an empty type is not stated;
    no topics if the robot has none. Other roles are as discovery found them."""

    base_frame: str = ""
    """The frame of its base, if it is drawn by frames."""

    map_frame: str = ""
    """The frame that the robot is drawn in; empty if it is not configured."""

    elsewhere: frozenset[Role] = frozenset()
    """Roles on another bridge; the diagnosis of that bridge reports them."""

    found_as: str = ""
    """Its name in discovery without settings; empty if it was not found."""


def merge_configured(
    findings: Findings, configured: Sequence[ConfiguredRobot], types: Mapping[str, str]
) -> tuple[Findings, dict[str, ConfiguredRobot]]:
    """Return the findings to measure, and the configured robots by name.

    Robots that were found but not configured are left out.

    Args:
        findings: The findings of discovery.
        configured: The robots that a person configured, at least one.
        types: Types by topic, from the bridge or a list.

    """
    taken: set[str] = set()
    robots: list[FoundRobot] = []
    by_name: dict[str, ConfiguredRobot] = {}
    for one, there in zip(configured, _found(configured, findings.robots), strict=True):
        name = free_name(one.name, taken)
        robots.append(_merged(name, one, there, types))
        by_name[name] = replace(one, found_as="" if there is None else there.name)
    return replace(findings, robots=tuple(robots)), by_name


def _found(
    configured: Sequence[ConfiguredRobot], robots: Sequence[FoundRobot]
) -> list[FoundRobot | None]:
    """Return the found robot for each configured robot, each at most once."""
    left = list(robots)
    found: list[FoundRobot | None] = [None for _ in configured]
    # A name is the weakest match: it is compared after all topics.
    for fits in (_is_called, _has_its_topics, _has_its_name):
        for place, one in enumerate(configured):
            if found[place] is None:
                there = next((robot for robot in left if fits(one, robot)), None)
                if there is not None:
                    left.remove(there)
                    found[place] = there
    return found


def _is_called(one: ConfiguredRobot, robot: FoundRobot) -> bool:
    return one.found_as == robot.name


def _has_its_name(one: ConfiguredRobot, robot: FoundRobot) -> bool:
    return one.name == robot.name


def _has_its_topics(one: ConfiguredRobot, robot: FoundRobot) -> bool:
    velocity: tuple[Role, ...] = ("velocity",)
    for alike in (WHERE, velocity):
        text = [each for role in alike for each in one.topics.get(role, ())]
        there = {each.topic for role in alike for each in robot.guesses.get(role, ())}
        if any(_plain(topic) in there for topic, _ in text):
            return True
    whole = Buffer().name(robot.base_frame, robot.tf_namespace or "")
    return whole != "" and one.base_frame == whole


def _merged(
    name: str,
    one: ConfiguredRobot,
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


def _type(role: Role, behind: str, text: str) -> str:
    """Return the type that WebMap uses to send and to subscribe."""
    behind = behind.strip()
    if role == "velocity":
        return text or (behind if is_type(behind, *VELOCITY) else TYPES[role])
    return behind or text or TYPES.get(role, "")


def _plain(topic: str) -> str:
    try:
        return normalise_topic(topic)
    except ConfigError:  # creating the robot reports this error
        return topic
