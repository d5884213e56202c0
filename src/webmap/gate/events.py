"""What the shell reports to the rules, besides the messages of the pipe."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import msgspec

from webmap.base.geometry import Twist

Lane = Literal["control", "odometry", "tasks"]
Outcome = Literal["reached", "failed", "cancelled"]


class Key(NamedTuple):
    """What makes a machine one machine: its bridge and its velocity topic."""

    url: str
    topic: str


class Press(NamedTuple):
    """One press of STOP. Every press has an identity that no other one has."""

    by: str
    """Who pressed it, for people."""
    id: str
    """The identity, which a reset must name."""


class ScanFold(msgspec.Struct, frozen=True):
    """What a scan that was folded to fewer beams was before."""

    each: int
    """How many beams lie from one beam of the fold to the next."""
    beams: int
    """How many there were."""
    behind: Sequence[Sequence[float]]
    """For each beam of the fold the next things behind its nearest hit, in metres."""
    said: Sequence[int]
    """For each beam of the fold, how many of those folded into it say anything."""
    asked: Sequence[int]
    """For each beam of the fold, how many were folded into it."""


class Scan(msgspec.Struct, frozen=True):
    """The newest scan."""

    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: Sequence[float]
    """In metres: inf is nothing there, -inf too near, NaN unknown (REP 117)."""
    arrived: float
    """When it came, on the gate's clock."""
    fold: ScanFold | None = None
    """What it was before it was folded, if it was."""
    refused: str | None = None
    """Why nobody looked at it, in words, if nobody did."""
    frame: str = ""
    """The frame that it says it is in; "" if it names none."""


@dataclass(frozen=True, slots=True)
class LinkUp:
    """A socket to a bridge is open."""

    url: str
    lane: Lane


@dataclass(frozen=True, slots=True)
class LinkDown:
    """A socket to a bridge is gone."""

    url: str
    lane: Lane
    spent: bool = False
    """Whether it goes on for a goal, and what was written before that arrives."""


@dataclass(frozen=True, slots=True)
class PingAnswered:
    """The bridge answered a ping on the control socket."""

    url: str
    asked_at: float
    """When that ping was sent: what was written before it has arrived."""


@dataclass(frozen=True, slots=True)
class TwistWritten:
    """What became of a velocity that was to be written."""

    key: Key
    twist: Twist
    epoch: int | None
    by: str | None
    done: bool
    """Whether it went out; if not, it was dropped and will not go out later."""


@dataclass(frozen=True, slots=True)
class GoalWritten:
    """What became of a goal that was to be written."""

    robot: str
    id: str
    x: float
    y: float
    yaw: float
    by: str
    done: bool


@dataclass(frozen=True, slots=True)
class PoseWritten:
    """What became of a word on where the robot is."""

    robot: str
    x: float
    y: float
    yaw: float
    by: str
    done: bool


@dataclass(frozen=True, slots=True)
class GoalProgress:
    """The robot says how a goal goes; what it does not say is ``None``."""

    robot: str
    id: str
    active: bool
    """Whether it is under way, or only accepted."""
    left: float | None = None
    """Metres to go."""
    time: float | None = None
    """Seconds under way."""
    eta: float | None = None
    """Seconds to go."""
    recoveries: int | None = None


@dataclass(frozen=True, slots=True)
class GoalEnded:
    """The action reported the result of a goal, whatever it is."""

    robot: str
    id: str
    outcome: Outcome = "reached"
    why: str = ""
    """The robot's reason, in its own words."""
    no_actions: bool = False
    """Whether the bridge takes no goals of actions at all."""


@dataclass(frozen=True, slots=True)
class GoalLost:
    """What would have told how a goal goes is gone; the robot may go on."""

    robot: str
    id: str
    why: str


@dataclass(frozen=True, slots=True)
class HookEnded:
    """What became of a ``RunHook``."""

    robot: str
    hook: dict[str, str]
    number: int
    why: str | None
    """Why the robot was not told, or did not do it, in words."""


@dataclass(frozen=True, slots=True)
class EchoReceived:
    """A velocity came back on the topic that the gate writes to."""

    key: Key
    twist: Twist


@dataclass(frozen=True, slots=True)
class OdometryReceived:
    """Odometry came; ``twist`` is ``None`` if it says nothing of velocity.

    Its numbers are finite for motion in the plane, and may be NaN for the others.
    """

    key: Key
    twist: Twist | None
    sent_after: float = float("inf")
    """A moment after which the bridge said it, on the gate's clock; one that is yet to
    come counts for the moment when it came."""


@dataclass(frozen=True, slots=True)
class ScanReceived:
    """A laser scan came."""

    key: Key
    topic: str
    sweep: Scan


@dataclass(frozen=True, slots=True)
class StopRecord:
    """What a stop test found."""

    seconds: float | None
    """How long the machine went on without commands; ``None`` if it did not stop."""
    date: str
    """The day of the test, as ``2026-11-21``."""


@dataclass(frozen=True, slots=True)
class LockState:
    """Whether this gate alone on this computer has the machine."""

    key: Key
    held: bool
    driven: bool = False
    """Whether an earlier gate died while it drove the machine (S13)."""
    why: str | None = None
    latched: Press | None = None
    """The STOP that stands on disk, if one does (S7)."""
    tested: StopRecord | None = None
    """What the last stop test found, if there was one."""
    elsewhere: bool = False
    """Whether another gate on this computer has it."""


@dataclass(frozen=True, slots=True)
class StopFileChanged:
    """The file of a STOP is another than before, or there is none any more."""

    key: Key
    press: Press | None
    """The STOP that stands on disk now, if one does."""


@dataclass(frozen=True, slots=True)
class StopSaved:
    """What became of a ``SaveStop``."""

    key: Key
    number: int
    error: str | None
    """Why the disk does not have it, in words."""


@dataclass(frozen=True, slots=True)
class StopTestSaved:
    """The result of a stop test has its date."""

    key: Key
    record: StopRecord


@dataclass(frozen=True, slots=True)
class Shutdown:
    """The process is to end: stop what is driven, then be silent."""

    why: str


Event = (
    LinkUp
    | LinkDown
    | PingAnswered
    | TwistWritten
    | GoalWritten
    | PoseWritten
    | GoalProgress
    | GoalEnded
    | GoalLost
    | HookEnded
    | EchoReceived
    | OdometryReceived
    | ScanReceived
    | LockState
    | StopSaved
    | StopFileChanged
    | StopTestSaved
    | Shutdown
)
