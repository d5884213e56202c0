"""What the readiness check saw."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from webmap.discovery.doctor.meant import MeantRobot
from webmap.discovery.found import Findings
from webmap.discovery.tf_robots import MAP
from webmap.ros.rosbridge.checks import LinkFacts

MOST_ROBOTS = 10
"""How many robots are listened to."""


@dataclass(frozen=True, slots=True)
class Heard:
    """What came on one topic while it was listened to."""

    count: int = 0
    seconds: float = 0.0
    """How long it was listened to."""

    longest_gap: float = 0.0
    """The longest time without a message, in seconds, to the end of listening."""

    bytes: int = 0
    frame: str = ""
    """The frame that the newest message names."""

    stamp: float | None = None
    """The newest message's stamp, in seconds of the robot's clock; None if unset."""

    arrived: float = 0.0
    """When it came in, in seconds of this machine's wall clock."""

    binary: bool = False
    """Whether messages came in a binary encoding."""

    trouble: str = ""
    """Why a message could not be read."""

    child: str = ""
    """The frame that moves in it, where the message names one, as odometry does."""

    every: float = 0.0
    """Seconds from one message to the next, where only a few were listened for; 0 if
    fewer than two came."""

    @property
    def rate(self) -> float:
        """Messages a second."""
        return self.count / self.seconds if self.seconds else 0.0


@dataclass(frozen=True, slots=True)
class Clock:
    """The robot's clock beside this machine's."""

    ahead: float
    """Seconds by which the robot's is ahead."""

    round_trip: float
    """Seconds that asking took; the offset is known to half of it."""


@dataclass(frozen=True, slots=True)
class Way:
    """The frames from the map to a robot's odometry, its base and its scanner."""

    frame: str
    """The frame of the odometry; that of the base where there is none."""

    missing: str = ""
    """Why nothing leads there from the map, empty if it does."""

    oddities: tuple[str, ...] = ()
    """What was odd in these frames, in sentences."""

    base: str = ""
    """The frame of the base, as odometry names it."""

    base_missing: str = ""
    """Why nothing leads there from the odometry's frame."""

    scan: str = ""
    """The frame of the scanner, empty if there is none or it said nothing."""

    scan_missing: str = ""
    """Why nothing leads there from the base."""

    start: str = MAP
    """The frame that the robot is drawn in: its map's, or where its frames begin."""


@dataclass(frozen=True, slots=True)
class Observed:
    """All that was seen of one bridge and the robots behind it."""

    url: str
    trouble: str = ""
    """Why the bridge could not be reached, empty if it was."""

    unlisted: str = ""
    """Why the bridge does not list its topics, empty if it does."""

    told: bool = False
    """Whether the topics are those that the user gave."""

    shown: tuple[str, ...] = ()
    """Topics that no client needs and that the bridge shows all the same."""

    types: Mapping[str, str] = field(default_factory=dict)
    """Types by topic, as the bridge or the user's list has them."""

    findings: Findings = field(default_factory=Findings)
    """The robots that are measured, with the topics that are in use."""

    meant: Mapping[str, MeantRobot] = field(default_factory=dict)
    """What somebody said of them, by their names; empty if all of it was found."""

    others: tuple[str, ...] = ()
    """Robots that were found too and not measured, since nobody meant them."""

    clock: Clock | None = None
    publishers: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """The nodes that publish on a topic, where the bridge said so."""

    subscribers: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """The nodes that listen to a topic, where the bridge said so."""

    heard: Mapping[str, Heard] = field(default_factory=dict)
    ways: Mapping[str, Way] = field(default_factory=dict)
    """What the frames say of each robot that has some, by its name."""

    link: LinkFacts = field(default_factory=LinkFacts)
    """What was found out about the bridge itself."""
