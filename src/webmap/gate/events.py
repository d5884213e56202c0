"""The events that the shell sends to the rules, besides the messages of the pipe."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import msgspec

from webmap.base.geometry import Twist
from webmap.config.motion import StopHook
from webmap.gate.protocol import Identity

Lane = Literal["control", "odometry", "tasks"]
Outcome = Literal["reached", "failed", "cancelled"]


class Key(NamedTuple):
    """The key of a machine: its bridge and its velocity topic."""

    url: str
    topic: str


class Press(msgspec.Struct, frozen=True, repr_omit_defaults=True):
    """One press of STOP, with an identity of its own."""

    by: str
    """The name of who pressed STOP."""
    id: str
    """The identity, which a reset must name."""
    identity: Identity | None = None
    """That of the person; None for a program, or if it is unknown."""


class ScanFold(msgspec.Struct, frozen=True):
    """Facts about a scan from before it was folded to fewer beams."""

    each: int
    """The number of beams from one beam of the fold to the next."""
    beams: int
    """The number of beams before the fold."""
    behind: Sequence[Sequence[float]]
    """For each beam of the fold, the next things behind its nearest hit, in metres."""
    known: Sequence[int]
    """For each beam of the fold, the number of known beams folded into it."""
    total: Sequence[int]
    """For each beam of the fold, the number of beams folded into it."""


class Scan(msgspec.Struct, frozen=True):
    """A laser scan for scan assist, in the sensor's frame."""

    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: Sequence[float]
    """In metres; inf: nothing there, -inf: too near, NaN: unknown (REP 117)."""
    arrived: float
    """The time of arrival, on the gate's clock."""
    fold: ScanFold | None = None
    """Set if the scan was folded."""
    refused: str | None = None
    """Why the scan does not count, as text, if it does not."""
    frame: str = ""
    """The frame that the scan names; "" if it names none."""


@dataclass(frozen=True, slots=True)
class LinkUp:
    """A socket to a bridge is open."""

    url: str
    lane: Lane
    only_echoes: bool = False
    """Whether an answered ping does not prove that earlier messages were handled."""


@dataclass(frozen=True, slots=True)
class LinkDown:
    """A socket to a bridge is closed."""

    url: str
    lane: Lane
    spent: bool = False
    """Whether the socket stays open for a goal, so that data written before arrives."""


@dataclass(frozen=True, slots=True)
class ActionsOffered:
    """The actions that goals can be sent to at a bridge of Foxglove have changed."""

    url: str
    actions: frozenset[str]
    """All of them, by name."""


@dataclass(frozen=True, slots=True)
class PingAnswered:
    """The bridge answered a ping on the control socket."""

    url: str
    asked_at: float
    """When that ping was sent; data written before has arrived."""


@dataclass(frozen=True, slots=True)
class TwistWritten:
    """A ``WriteTwist`` was done or dropped; comes before any event of another kind."""

    key: Key
    twist: Twist
    epoch: int | None
    by: str | None
    done: bool
    """Whether it was written; if not, it was dropped and is not written later."""


@dataclass(frozen=True, slots=True)
class GoalWritten:
    """A ``SendGoal`` was done or dropped; the robot has not answered yet."""

    robot: str
    id: str
    x: float
    y: float
    yaw: float
    by: str
    done: bool


@dataclass(frozen=True, slots=True)
class PoseWritten:
    """A ``SendPose`` was done or dropped; robots do not answer a pose."""

    robot: str
    x: float
    y: float
    yaw: float
    by: str
    done: bool


@dataclass(frozen=True, slots=True)
class GoalProgress:
    """The robot reports progress of a goal; unreported values are ``None``."""

    robot: str
    id: str
    active: bool
    """Whether the robot follows it; otherwise it is only accepted."""
    left: float | None = None
    """Metres to go."""
    time: float | None = None
    """Seconds since the robot began."""
    eta: float | None = None
    """Seconds to go."""
    recoveries: int | None = None


@dataclass(frozen=True, slots=True)
class GoalEnded:
    """The action reported the result of a goal."""

    robot: str
    id: str
    outcome: Outcome = "reached"
    why: str = ""
    """The reason in the text of the robot."""
    no_actions: bool = False
    """Whether the bridge does not support action goals at all."""


@dataclass(frozen=True, slots=True)
class GoalLost:
    """The source of progress of a goal is lost; the robot may still follow it."""

    robot: str
    id: str
    why: str


@dataclass(frozen=True, slots=True)
class HookEnded:
    """A ``RunHook`` has ended: the message was written, or the service answered."""

    robot: str
    hook: StopHook
    number: int
    why: str | None
    """Why it was not sent or the robot refused it, as text; ``None`` on success."""


@dataclass(frozen=True, slots=True)
class EchoReceived:
    """A velocity was received on the topic that the gate writes to."""

    key: Key
    twist: Twist


@dataclass(frozen=True, slots=True)
class OdometryReceived:
    """Odometry was received; ``twist`` is ``None`` if it has no velocity.

    Its numbers are finite for motion in the plane, and may be NaN for the others.
    """

    key: Key
    twist: Twist | None
    sent_after: float = float("inf")
    """A time after which the bridge sent it, on the gate's clock; a time in the future
    counts as the time of arrival."""


@dataclass(frozen=True, slots=True)
class ScanReceived:
    """A scan of a watched machine was received, folded to 720 beams at most."""

    key: Key
    topic: str
    sweep: Scan


@dataclass(frozen=True, slots=True)
class StopRecord:
    """The result of a stop test, as it is kept on disk."""

    seconds: float | None
    """Seconds from the last command to standstill; ``None`` if it did not stop."""
    date: str
    """The day of the test, as ``2026-11-21``."""
    error: float = 0.0
    """Seconds by which the measured time may be too long."""


@dataclass(frozen=True, slots=True)
class CheckRecord:
    """The newest check before driving, as it is kept on disk."""

    by: str
    """The name of the person who made it."""
    at: float
    """When, in seconds since 1970."""
    age: float
    """Seconds since then, when the disk was read; negative if the clock was wrong."""


@dataclass(frozen=True, slots=True)
class LockState:
    """Whether this gate, and so no other gate on this computer, has the machine."""

    key: Key
    held: bool
    driven: bool = False
    """Whether an earlier gate died while it drove the machine (S13)."""
    why: str | None = None
    latched: Press | None = None
    """The active STOP on disk, if there is one (S7)."""
    tested: StopRecord | None = None
    """The result of the last stop test, if there is one."""
    elsewhere: bool = False
    """Whether another gate on this computer has the machine."""
    checked: CheckRecord | None = None
    """The newest check before driving, if there is one."""


@dataclass(frozen=True, slots=True)
class StopFileChanged:
    """The file of a STOP has changed or was removed."""

    key: Key
    press: Press | None
    """The active STOP on disk now, if there is one."""


@dataclass(frozen=True, slots=True)
class StopSaved:
    """A ``SaveStop`` was written to the disk, or failed."""

    key: Key
    number: int
    error: str | None
    """Why it could not be saved, as text."""


@dataclass(frozen=True, slots=True)
class StopTestSaved:
    """The result of a ``SaveStopTest``, with its date."""

    key: Key
    record: StopRecord


@dataclass(frozen=True, slots=True)
class CheckSaved:
    """A ``SaveCheck``, with its time."""

    key: Key
    record: CheckRecord


@dataclass(frozen=True, slots=True)
class Shutdown:
    """The process must end: stop the driven machines, then send nothing more."""

    why: str


Event = (
    LinkUp
    | LinkDown
    | ActionsOffered
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
    | CheckSaved
    | Shutdown
)
