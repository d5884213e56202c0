"""What a test recorded, and the invariants that it must keep despite any fault.

A witness records messages and velocities, and a sentinel how late the machine was
meanwhile. Each rule checks the received velocities, oldest first, and reports
violations in sentences; times in them are seconds since the first velocity.
"""

import itertools
import math
import threading
import time
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from webmap.base.geometry import Twist


@dataclass(frozen=True, slots=True)
class ClientMessage:
    """One message that a client sent to the robot's rosbridge."""

    at: float
    """Seconds of the monotonic clock."""

    link: int
    """Number of its WebSocket, counted from 1."""

    message: dict[str, Any]

    @property
    def op(self) -> Any:
        """The operation of the message, such as ``publish``."""
        return self.message.get("op")

    @property
    def topic(self) -> Any:
        """The topic, if the message has one."""
        return self.message.get("topic")


@dataclass(frozen=True, slots=True)
class ReceivedTwist:
    """One velocity that the robot received."""

    at: float
    """Seconds of the monotonic clock."""

    twist: Twist
    link: int = 1

    @property
    def is_zero(self) -> bool:
        """Whether it stops the robot."""
        return self.twist.is_zero

    @property
    def speed(self) -> float:
        """Metres per second, in any direction."""
        return self.twist.speed


@dataclass(frozen=True, slots=True)
class Moved:
    """The velocity of the wheels at a time."""

    at: float
    twist: Twist


@dataclass
class WitnessLog:
    """All records of a witness, oldest first; may be read while it grows."""

    messages: list[ClientMessage] = field(default_factory=list)
    twists: list[ReceivedTwist] = field(default_factory=list)
    moved: list[Moved] = field(default_factory=list)

    def of(self, op: str, topic: str | None = None) -> list[ClientMessage]:
        """Return the messages with an operation, and with a topic if given."""
        return [
            message
            for message in list(self.messages)
            if message.op == op and topic in (None, message.topic)
        ]

    def first_zero(self, since: float) -> float | None:
        """Return the time of the first zero after ``since``."""
        return next((t.at for t in _from(self.twists, since) if t.is_zero), None)

    def moving_since(
        self, since: float, until: float = math.inf
    ) -> list[ReceivedTwist]:
        """Return the nonzero velocities of a period."""
        return [t for t in _from(self.twists, since) if t.at < until and not t.is_zero]

    def standstill(self, since: float, slow: float = 0.01) -> float | None:
        """Return when the wheels came to rest after ``since`` and stayed at rest.

        Args:
            since: Seconds of the monotonic clock.
            slow: Metres or radians per second that count as rest.

        """
        rest = None
        for moved in _from(self.moved, since):
            if max(moved.twist.speed, moved.twist.turn) > slow:
                rest = None
            elif rest is None:
                rest = moved.at
        return rest


Record = TypeVar("Record", ReceivedTwist, Moved)


def _from(records: list[Record], since: float) -> list[Record]:
    """Return the records since a time.

    A log grows for the lifetime of a robot, and waiting tests read it repeatedly in the
    process of the witness: old records must cost nothing.
    """
    return records[bisect_left(records, since, key=lambda record: record.at) :]


class Sentinel:
    """Measures scheduling delay while a test measures something else.

    A time limit on a busy machine is the promised limit plus the delay of the machine
    in the same seconds; this thread sleeps for 5 ms at a time and records how late it
    wakes.
    """

    PERIOD = 0.005
    """Seconds between two wakes."""

    def __init__(self) -> None:
        self._late: list[tuple[float, float]] = []
        self._end = threading.Event()
        self._thread = threading.Thread(
            target=self._watch, name="sentinel", daemon=True
        )

    def __enter__(self) -> "Sentinel":
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._end.set()
        self._thread.join(5)

    def worst(self, since: float, until: float | None = None) -> float:
        """Return the longest delay in a period of the monotonic clock, in seconds."""
        until = time.monotonic() if until is None else until
        return max((late for _, late in self._between(since, until)), default=0.0)

    def stolen(self, since: float, until: float | None = None) -> float:
        """Return the total waiting time of a ready thread in a period, in seconds.

        Data that passes several threads and processes waits in each of them, so this is
        the time that a busy machine can add from end to end. A wake that is at most
        1 ms late is normal on an idle machine and does not count.
        """
        until = time.monotonic() if until is None else until
        return sum(late for _, late in self._between(since, until) if late > 0.001)

    def _between(self, since: float, until: float) -> list[tuple[float, float]]:
        """Return the wakes that were due in a period, each with its delay."""
        first = bisect_left(self._late, (since, 0.0))
        return [(at, late) for at, late in self._late[first:] if at <= until + late]

    def _watch(self) -> None:
        while not self._end.is_set():
            due = time.monotonic() + self.PERIOD
            time.sleep(self.PERIOD)
            now = time.monotonic()
            self._late.append((now, max(0.0, now - due)))


BREATH = 0.5
"""Seconds without a velocity that separate two activities."""

RAMP_INTERVAL = 0.1
"""Longest time of acceleration that counts between two velocities, in seconds."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """The limits that no velocity in a log may exceed."""

    v_max: float = math.inf
    """Metres per second."""

    w_max: float = math.inf
    """Radians per second."""

    z_max: float = math.inf
    """Metres per second upward and downward."""

    a_max: float | None = None
    """Metres per second squared when speeding up; None for no limit."""

    zeros: float = 0.5
    """Seconds for which zeros are sent after a stop; after that nothing is sent."""

    late: int = 0
    """Most nonzero velocities that a cut connection may deliver late."""

    slack: float = 0.1
    """Seconds by which the machine may have been late in all of this."""


@dataclass(frozen=True, slots=True)
class Quiet:
    """A period in which nothing may move the robot."""

    begin: float
    end: float
    why: str


@dataclass(frozen=True, slots=True)
class Story:
    """The events at the robot while the velocities came.

    Times are seconds of the monotonic clock.
    """

    quiet: Sequence[Quiet] = ()
    handovers: Sequence[float] = ()
    """When another operator got control of the robot."""

    unreachable: Sequence[tuple[float, float]] = ()
    """When nothing could be sent to the robot."""

    causes: Sequence[float] = ()
    """When zeros may start again: a STOP, or a new connection."""


def check_invariants(
    log: Sequence[ReceivedTwist],
    bounds: Bounds | None = None,
    *,
    quiet: Sequence[Quiet] = (),
    handovers: Sequence[float] = (),
    unreachable: Sequence[tuple[float, float]] = (),
    causes: Sequence[float] = (),
) -> list[str]:
    """Return the violations in the velocities that a robot received, in sentences.

    Args:
        log: The velocities, oldest first. The last activity must be over.
        bounds: The limits.
        quiet: Periods in which nothing may move the robot, such as after a fault.
        handovers: When another operator got control, in seconds of the monotonic clock.
        unreachable: When nothing could be sent to the robot.
        causes: When zeros may start again: a STOP, or a new connection.

    """
    velocities = list(log)
    if not velocities:
        return []
    story = Story(quiet, handovers, unreachable, causes)
    bounds = bounds or Bounds()
    wrong = [found for rule in RULES for found in rule(velocities, bounds, story)]
    begin = velocities[0].at
    return [f"{at - begin:.3f} s: {text}" for at, text in sorted(wrong)]


Finding = tuple[float, str]


def _limits(
    log: list[ReceivedTwist], bounds: Bounds, story: Story
) -> Iterator[Finding]:
    """Every velocity is finite and within the limits."""
    for velocity in log:
        if not velocity.twist.is_finite:
            yield velocity.at, f"{velocity.twist} is not finite"
        elif velocity.speed > bounds.v_max * (1 + 1e-9):
            yield (
                velocity.at,
                f"{velocity.speed:g} m/s is above the limit of {bounds.v_max:g}",
            )
        elif velocity.twist.turn > bounds.w_max * (1 + 1e-9):
            turn = velocity.twist.turn
            yield velocity.at, f"{turn:g} rad/s is above the limit of {bounds.w_max:g}"
        elif abs(velocity.twist.vz) > bounds.z_max * (1 + 1e-9):
            z = velocity.twist.vz
            yield (
                velocity.at,
                f"{z:g} m/s upward is above the limit of {bounds.z_max:g}",
            )


def _quiet(log: list[ReceivedTwist], bounds: Bounds, story: Story) -> Iterator[Finding]:
    """Nothing moves the robot in a quiet period."""
    for quiet in story.quiet:
        moving = [t for t in log if quiet.begin < t.at < quiet.end and not t.is_zero]
        if moving:
            late = moving[-1].at - quiet.begin
            yield (
                moving[0].at,
                f"{len(moving)} moving velocities came up to {late:.3f} s after "
                f"the robot had to be quiet: {quiet.why}",
            )


def _last_is_zero(
    log: list[ReceivedTwist], bounds: Bounds, story: Story
) -> Iterator[Finding]:
    """The last velocity of every activity is zero.

    If the robot was unreachable then, the first velocity that reaches it later is
    zero, except for the few that the connection had already buffered.
    """
    for index, velocity in enumerate(log):
        following = log[index + 1] if index + 1 < len(log) else None
        over = following is None or following.at - velocity.at > BREATH + bounds.slack
        if velocity.is_zero or not over:
            continue
        until = math.inf if following is None else following.at
        if not any(b < until and e > velocity.at for b, e in story.unreachable):
            yield velocity.at, "an activity ended with a velocity that is not zero"
            continue
        late = list(itertools.takewhile(lambda t: not t.is_zero, log[index + 1 :]))
        if len(late) > bounds.late:
            what = f"{len(late)} velocities" if bounds.late else "the first velocity"
            is_not = "come before the first" if bounds.late else "is not"
            yield late[0].at, f"{what} after a cut {is_not} zero"


def _handovers(
    log: list[ReceivedTwist], bounds: Bounds, story: Story
) -> Iterator[Finding]:
    """There is a zero between two operators."""
    for at in story.handovers:
        before = [t for t in log if t.at <= at]
        after = [t for t in log if t.at > at]
        if not before or not after:
            continue
        if not before[-1].is_zero and not after[0].is_zero:
            yield after[0].at, "another driver began without a zero in between"


def _silence(
    log: list[ReceivedTwist], bounds: Bounds, story: Story
) -> Iterator[Finding]:
    """Zeros end after a limited time, so that other programs can publish."""
    begun = -math.inf
    was_moving = True
    for velocity in log:
        if not velocity.is_zero:
            was_moving = True
            continue
        if was_moving:
            begun, was_moving = velocity.at, False
        cause = max((c for c in story.causes if c <= velocity.at), default=-math.inf)
        lasted = velocity.at - max(begun, cause)
        if lasted > bounds.zeros + bounds.slack:
            yield velocity.at, f"zeros go on {lasted:.3f} s after the robot was stopped"
            return


def _ramp(log: list[ReceivedTwist], bounds: Bounds, story: Story) -> Iterator[Finding]:
    """Speeding up is within the acceleration; slowing down is not limited."""
    if bounds.a_max is None:
        return
    before, at = 0.0, -math.inf
    for velocity in log:
        elapsed = min(velocity.at - at, RAMP_INTERVAL) + bounds.slack
        if velocity.speed - before > bounds.a_max * elapsed + 1e-9:
            yield (
                velocity.at,
                f"from {before:g} to {velocity.speed:g} m/s in "
                f"{velocity.at - at:.3f} s",
            )
        before, at = velocity.speed, velocity.at


RULES: tuple[Callable[[list[ReceivedTwist], Bounds, Story], Iterator[Finding]], ...] = (
    _limits,
    _quiet,
    _last_is_zero,
    _handovers,
    _silence,
    _ramp,
)
