"""What the diagnosis knows: the configured robots, and what it measured."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from webmap.base.errors import ConfigError
from webmap.discovery.findings import Findings, FoundRobot, Guess, TopicRole, free_name
from webmap.discovery.rules import VELOCITY
from webmap.discovery.tf_robots import MAP
from webmap.ros.names import is_type, normalise_topic
from webmap.ros.rosbridge.checks import LinkFacts
from webmap.ros.tf import Buffer

RULE = "as configured"

TYPES: Mapping[TopicRole, str] = {
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

WHERE: tuple[TopicRole, ...] = ("odometry", "pose")


@dataclass(frozen=True, slots=True)
class ConfiguredRobot:
    """A robot of a fleet file or of options, by the roles of its topics."""

    name: str
    topics: Mapping[TopicRole, tuple[tuple[str, str], ...]] = field(
        default_factory=dict
    )
    """The topics of each configured role with their types; an empty type is not stated;
    no topics if the robot has none. Other roles are as discovery found them."""

    base_frame: str = ""
    """The frame of its base, if it is drawn by frames."""

    map_frame: str = ""
    """The frame that the robot is drawn in; empty if it is not configured."""

    elsewhere: frozenset[TopicRole] = frozenset()
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
    velocity: tuple[TopicRole, ...] = ("velocity",)
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


def _type(role: TopicRole, behind: str, text: str) -> str:
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


MOST_ROBOTS = 10
"""Most robots that are listened to."""


@dataclass(frozen=True, slots=True)
class Measurement:
    """How often messages of one topic came, how large they were, and how old."""

    count: int = 0
    seconds: float = 0.0
    """How long the topic was listened to."""

    longest_gap: float = 0.0
    """The longest time without a message, in seconds, up to the end of listening."""

    bytes: int = 0
    frame: str = ""
    """The frame in the newest message."""

    stamp: float | None = None
    """Stamp of the newest message, in seconds of the robot's clock; None if unset."""

    arrived: float = 0.0
    """When the newest message came, in seconds of this machine's wall clock."""

    binary: bool = False
    """Whether messages came in a binary encoding."""

    trouble: str = ""
    """Why a message could not be read."""

    child: str = ""
    """The moving frame, if the message names one, as odometry does."""

    every: float = 0.0
    """Seconds from one message to the next, if only a few were listened for; 0 if fewer
    than two came."""

    @property
    def rate(self) -> float:
        """Messages a second; 0 if no time was measured."""
        return self.count / self.seconds if self.seconds else 0.0


@dataclass(frozen=True, slots=True)
class Clock:
    """The robot's clock compared with this machine's clock."""

    ahead: float
    """Seconds by which the robot's clock is ahead."""

    round_trip: float
    """Seconds of the request; the error of ``ahead`` is at most half of it."""


@dataclass(frozen=True, slots=True)
class FramePath:
    """The frames from the map to a robot's odometry, its base and its scanner."""

    frame: str
    """The frame of the odometry; the frame of the base if there is none."""

    missing: str = ""
    """Why no transform leads to it from the map, empty if one does."""

    oddities: tuple[str, ...] = ()
    """The oddities in these frames, in sentences."""

    base: str = ""
    """The frame of the base, as odometry names it."""

    base_missing: str = ""
    """Why no transform leads to it from the odometry's frame."""

    scan: str = ""
    """The frame of the scanner; empty if there is none or it sent nothing."""

    scan_missing: str = ""
    """Why no transform leads to it from the base."""

    start: str = MAP
    """The frame that the robot is drawn in: its map's, or the root of its frames."""


@dataclass(frozen=True, slots=True)
class BridgeFacts:
    """All observations of one bridge and the robots behind it."""

    url: str
    trouble: str = ""
    """Why the bridge could not be reached, empty if it was."""

    unlisted: str = ""
    """Why the bridge does not list its topics, empty if it does."""

    topics_given: bool = False
    """Whether the list of topics was given by hand."""

    shown: tuple[str, ...] = ()
    """Topics that no client needs and that the bridge lists."""

    types: Mapping[str, str] = field(default_factory=dict)
    """Types by topic, from the bridge or the given list."""

    findings: Findings = field(default_factory=Findings)
    """The robots that are measured, with the topics that are in use."""

    configured: Mapping[str, ConfiguredRobot] = field(default_factory=dict)
    """The configured robots by name; empty if all robots were found by discovery."""

    others: tuple[str, ...] = ()
    """Robots that were found but not measured, because they are not configured."""

    clock: Clock | None = None
    publishers: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """The nodes that publish on a topic, if the bridge lists them."""

    subscribers: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """The nodes that subscribe to a topic, if the bridge lists them."""

    measured: Mapping[str, Measurement] = field(default_factory=dict)
    frame_paths: Mapping[str, FramePath] = field(default_factory=dict)
    """The frames of each robot that has some, by its name."""

    link: LinkFacts = field(default_factory=LinkFacts)
    """Facts about the bridge itself."""

    open_at: tuple[str, ...] | None = None
    """Where other computers may reach the rosbridge of an agent, if the agent knows."""
