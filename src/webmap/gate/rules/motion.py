"""The velocities of one machine: commands, then zeros, then silence. No I/O.

Only zeros are repeated: a timer never repeats a command.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from webmap.base.geometry import Twist
from webmap.gate.actions import Emit, MarkDriven, WriteTwist
from webmap.gate.events import Key, TwistWritten
from webmap.gate.rules.connections import Lease
from webmap.gate.rules.delivery import Delivery
from webmap.gate.specs import PLANE, Axes, Speed, fit, ramp

PERIOD = 0.05
"""Seconds between two zeros."""

LENGTH = 0.5
"""Seconds from the first zero to silence."""

NEW_LINK_LENGTH = 3.0
"""The same when a zero is owed on a new link.

A bridge that has just started has not found the robot yet, and loses messages until it
has: up to 1.6 s were measured.
"""


HELD_PERIOD = 0.1
"""Seconds between two zeros while STOP is active (S8)."""

HELD_LENGTH = 600.0
"""Seconds for which these zeros continue.

This is longer than a person needs to get to the robot, but not for ever: a STOP that
was forgotten on Friday should not fill the topic and empty the robot's battery until
Monday. The zeros start again with another STOP and with every new link.
"""


class ZeroBurst:
    """The times of the zeros that stop a machine.

    Args:
        period: Seconds between two zeros.
        length: Seconds from the first zero to silence.

    """

    def __init__(self, period: float = PERIOD, length: float = LENGTH) -> None:
        self._period = period
        self._length = self._usual = length
        self.running = False
        self.started_at = float("-inf")
        self._due = float("-inf")

    def start(self, now: float, length: float | None = None) -> None:
        """Start, or start again; the first zero is due at once.

        A new start never makes silence come earlier than it would without.

        Args:
            now: Seconds, monotonic.
            length: Seconds from now to silence; by default that of the constructor.

        """
        length = self._usual if length is None else length
        left = self.started_at + self._length - now if self.running else 0.0
        self._length = max(length, left)
        self.running = True
        self.started_at = self._due = now

    def end(self) -> None:
        """Stop sending zeros."""
        self.running = False

    @property
    def next_at(self) -> float:
        """When the next zero is due, or the zeros end; infinity after that."""
        end = self.started_at + self._length
        return min(self._due, end) if self.running else math.inf

    def zero_due(self, now: float) -> bool:
        """Return whether a zero is due at ``now``; the caller must then write it."""
        if self.running and now >= self.started_at + self._length:
            self.running = False
        if not self.running or now < self._due:
            return False
        # Zeros that a suspended process missed are not made up for.
        self._due = max(self._due + self._period, now + self._period / 2)
        return True


DEADMAN = 0.2
"""The dead-man timeout: seconds for which an accepted command is valid (S1)."""

NEUTRAL = 0.2
"""Seconds for which inputs must be neutral before anything moves (S6)."""


class DeadMan:
    """Whether the holder may move the machine, and until when.

    A new dead-man is disarmed. It arms when the inputs were neutral for ``NEUTRAL``
    seconds without a gap, and disarms on any fault.

    A command extends the time only if it echoes a newer tick than the command before.
    So the whole loop must work: a page that still sends but receives nothing does not
    extend it.

    Args:
        needs_neutral: Whether neutral inputs are needed to arm. An operator may hold a
            stick or a key through an outage, so the inputs must be released first. A
            program makes each call anew; on a fault, its lease ends instead.

    """

    def __init__(self, *, needs_neutral: bool = True) -> None:
        self.armed = not needs_neutral
        self._needs_neutral = needs_neutral
        self._neutral_since: float | None = None
        self._accepted_at: float | None = None
        self._tick = -1

    @property
    def expires_at(self) -> float:
        """When the newest accepted command expires; in the past if there is none."""
        return (
            float("-inf")
            if self._accepted_at is None
            else (self._accepted_at + DEADMAN)
        )

    def expired(self, now: float) -> bool:
        """Return whether no accepted command is valid at ``now``."""
        return now >= self.expires_at

    def accept(self, neutral: bool, tick: int, now: float) -> None:
        """Note an accepted command.

        Args:
            neutral: Whether every input is released.
            tick: The tick that the command echoes.
            now: Seconds, monotonic.

        """
        if self.expired(now) and self._needs_neutral:
            self.disarm()
        if tick > self._tick:
            self._tick, self._accepted_at = tick, now
        if not neutral:
            self._neutral_since = None
        elif self._neutral_since is None:
            self._neutral_since = now
        elif now - self._neutral_since >= NEUTRAL:
            self.armed = True

    def disarm(self) -> None:
        """Require neutral inputs before anything moves again."""
        self.armed = not self._needs_neutral
        self._neutral_since = None


WRITE_INTERVAL = 0.02
"""The shortest time between two moving commands on the wire, in seconds."""

WAIT_LIMIT = 0.05
"""The longest time that a moving command waits to be written, in seconds.

Only a suspended gate keeps a command longer; the command is then too old (S2).
"""

RAMP_INTERVAL = 0.1
"""The longest time between two commands that the ramp uses, in seconds."""

ZERO = Twist()


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """The limits of a machine's motion at this moment."""

    speed: Speed
    a_max: float | None
    holonomic: bool
    axes: Axes = PLANE


class Motion:
    """The velocities of one machine.

    Args:
        key: The machine.
        control: Whether they arrive.
        bounds: Returns the limits that apply now.
        guard: Limits a velocity that is about to be written by the scans.
        emit: Called with each action.

    """

    def __init__(
        self,
        key: Key,
        control: Delivery,
        bounds: Callable[[], MotionLimits],
        guard: Callable[[Twist, float], Twist],
        emit: Emit,
    ) -> None:
        self.driving = False
        self.sent = ZERO
        """The velocity that was written last."""
        self.owes_zero = False
        """Whether a gate may have left the machine moving; it then gets a zero."""
        self._key = key
        self._control = control
        self._bounds = bounds
        self._scan_assist = guard
        self._emit = emit
        self._burst = ZeroBurst()
        self._held = ZeroBurst(HELD_PERIOD, HELD_LENGTH)
        self._left_alone = False
        self._pending: tuple[Twist, Lease, float] | None = None
        self._tried_at = float("-inf")
        self._sent_at = float("-inf")
        self.moved_at = float("-inf")
        """When the last velocity other than zero was written."""
        self.sent_epoch: int | None = None
        """The epoch of the last velocity; that of a zero is that of the motion."""

    @property
    def stopping(self) -> bool:
        """Whether zeros are being written."""
        return self._burst.running

    @property
    def silent(self) -> bool:
        """Whether no velocity is written now, nor later without a new event."""
        return not (self.driving or self.stopping or self._left_alone)

    @property
    def zero_at(self) -> float:
        """When the next zero is due, or the zeros end; infinity without zeros."""
        if self.stopping:
            return self._burst.next_at
        return self._held.next_at if self._control.up else math.inf

    def drive(self, wanted: Twist, lease: Lease, now: float) -> None:
        """Write ``wanted``, within the limits, for the holder of ``lease``."""
        if not self.driving:
            self._burst.end()
            self.driving = True
            self.owe_zero()
        self._pending = (wanted, lease, now)
        self._flush(now)

    def send_nothing(self) -> None:
        """Write nothing more, not even zero, although it moves (stop test only)."""
        self.driving, self._pending = False, None
        self._left_alone = True

    def halt(self, now: float) -> None:
        """Write zeros if the machine is driven."""
        if self.driving:
            self.zero(now)

    def zero(self, now: float, length: float | None = None) -> None:
        """Write zero at once, and continue with zeros for a moment.

        Args:
            now: Seconds, monotonic.
            length: Seconds from now to silence; by default :data:`LENGTH`.

        """
        self.begin_zeros(now, length)
        self.owe_zero()  # after the zero: no disk access may delay a stop

    def begin_zeros(self, now: float, length: float | None = None) -> None:
        """Do the first part of :meth:`zero`, which must follow: write zero at once."""
        if self.stopping and self._burst.started_at == now:
            return
        self.driving, self._pending, self._left_alone = False, None, False
        self._burst.start(now, length)
        self._write_zero_if_due(now)

    def hold(self, now: float) -> None:
        """Write zero at once, and continue while STOP is active (S8)."""
        self.zero(now)
        self._held.start(now)

    def release_hold(self) -> None:
        """End the zeros of STOP; nothing moves."""
        self._held.end()

    @property
    def held(self) -> bool:
        """Whether zeros are written because STOP is active."""
        return self._held.running

    def send_owed_zero(self, now: float) -> None:
        """Write an owed zero, because there is a link again."""
        if self.owes_zero:
            self._burst.end()  # its last zeros went to the previous link
            self.zero(now, NEW_LINK_LENGTH)

    def step(self, now: float) -> None:
        """Write the command or the zero that is due."""
        self._flush(now)
        self._write_zero_if_due(now)
        answered = self._control.answered_since(self._burst.started_at)
        if self.owes_zero and self.silent and answered:
            # Only what answers since the zero shows that it has arrived.
            self.owes_zero = False
            self._emit(MarkDriven(self._key, False))

    def on_written(self, write: TwistWritten, now: float) -> None:
        """Note a velocity that was written."""
        self.sent, self._sent_at, self.sent_epoch = write.twist, now, write.epoch
        if not write.twist.is_zero:
            self.moved_at = now

    def owe_zero(self) -> None:
        """Note that a gate may leave the machine moving: it must get a zero."""
        if not self.owes_zero:
            self.owes_zero = True
            self._emit(MarkDriven(self._key, True))

    def _write_zero_if_due(self, now: float) -> None:
        due = self._burst.zero_due(now)
        if not due and not self.stopping and self._control.up:
            due = self._held.zero_due(now)
        if due:
            self._write_zero()

    def _write_zero(self) -> None:
        self._emit(WriteTwist(self._key, ZERO, self.sent_epoch, None))

    def _flush(self, now: float) -> None:
        """Write the newest command, unless another was written just now."""
        if self._pending is None or now < self._tried_at + WRITE_INTERVAL:
            return
        wanted, lease, since = self._pending
        if now - since > WAIT_LIMIT:
            self._pending = None
            return
        if lease.epoch != self.sent_epoch and not self.sent.is_zero:
            self._write_zero()  # there is always a zero between two epochs
            return
        self._pending, self._tried_at = None, now
        # The scan assist checks the final velocity, because a ramp changes the path.
        twist = self._scan_assist(self._bounded(wanted, now), now)
        until = since + WAIT_LIMIT
        by = lease.connection
        self._emit(WriteTwist(self._key, twist, lease.epoch, by, until))

    def _bounded(self, wanted: Twist, now: float) -> Twist:
        bounds = self._bounds()
        twist = fit(wanted, bounds.speed, holonomic=bounds.holonomic, axes=bounds.axes)
        if bounds.a_max is None:
            return twist
        elapsed = min(now - self._sent_at, RAMP_INTERVAL)
        return ramp(self.sent, twist, bounds.a_max, elapsed)
