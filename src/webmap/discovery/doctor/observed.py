"""The observations of the diagnosis."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from webmap.discovery.doctor.configured import ConfiguredRobot
from webmap.discovery.found import Findings
from webmap.discovery.tf_robots import MAP
from webmap.ros.rosbridge.checks import LinkFacts

MOST_ROBOTS = 10
"""Most robots that are listened to."""


@dataclass(frozen=True, slots=True)
class Measurement:
    """The measurements of one topic."""

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
        """Messages a second."""
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
class Observed:
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
