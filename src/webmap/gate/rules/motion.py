"""What is written to one machine: commands, then zeros, then silence. No I/O.

The only thing that a timer writes here is zero.
"""

from collections.abc import Callable
from dataclasses import dataclass

from webmap.base.geometry import Twist
from webmap.gate.actions import Emit, MarkDriven, WriteTwist
from webmap.gate.events import Key, TwistWritten
from webmap.gate.limits import PLANE, Axes, Speed, fit, ramp
from webmap.gate.rules.connections import Lease
from webmap.gate.rules.health import LinkHealth

PERIOD = 0.05
"""Seconds between two zeros."""

LENGTH = 0.5
"""Seconds from the first zero to silence."""

NEW_LINK_LENGTH = 3.0
"""The same on a link that is new, where a zero is owed.

A bridge that was only just started has yet to find the robot, and loses what it is told
until then: up to 1.6 s were seen.
"""


HELD_PERIOD = 0.1
"""Seconds between two zeros while STOP stands (S8)."""

HELD_LENGTH = 600.0
"""Seconds for which they go on.

Longer than anybody needs to get to the robot, and not for ever: a STOP that was
forgotten over night should not fill its topic, or a robot's battery, until Monday.
They begin anew with another STOP and with every new link.
"""


class ZeroBurst:
    """When the zeros that stop a machine are due.

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
        """Begin, or begin again; the first zero is due at once.

        Silence never comes earlier by that than it would have come without.

        Args:
            now: Seconds, monotonic.
            length: Seconds from here to silence, in place of the usual ones.

        """
        length = self._usual if length is None else length
        left = self.started_at + self._length - now if self.running else 0.0
        self._length = max(length, left)
        self.running = True
        self.started_at = self._due = now

    def end(self) -> None:
        """Stop sending zeros."""
        self.running = False

    def zero_due(self, now: float) -> bool:
        """Return whether a zero is to be written at ``now``, and count on it."""
        if self.running and now >= self.started_at + self._length:
            self.running = False
        if not self.running or now < self._due:
            return False
        # Zeros that a sleeping process missed are not made up for.
        self._due = max(self._due + self._period, now + self._period / 2)
        return True


DEADMAN = 0.2
"""Seconds for which an accepted command holds (S1)."""

NEUTRAL = 0.2
"""Seconds of released inputs that must be seen before anything moves (S6)."""


class DeadMan:
    """Whether the holder of a lease may move the machine, and until when.

    A new dead-man is disarmed. It arms when every input was seen released for
    ``NEUTRAL`` seconds without a gap, and disarms on any doubt.

    A command holds if it echoes a newer tick than the one before it did. So it is fed
    by the whole loop: a hand that still sends but hears nothing feeds it no longer.

    Args:
        needs_neutral: A hand on a stick or a key may be held through an outage, so it
            must be seen released. A program's call is an act of its own each time;
            for it the lease ends on doubt instead.

    """

    def __init__(self, *, needs_neutral: bool = True) -> None:
        self.armed = not needs_neutral
        self._needs_neutral = needs_neutral
        self._neutral_since: float | None = None
        self._accepted_at: float | None = None
        self._tick = -1

    @property
    def expires_at(self) -> float:
        """When the newest accepted command ends; in the past if there is none."""
        return (
            float("-inf")
            if self._accepted_at is None
            else (self._accepted_at + DEADMAN)
        )

    def expired(self, now: float) -> bool:
        """Return whether no accepted command holds at ``now``."""
        return now >= self.expires_at

    def accept(self, neutral: bool, tick: int, now: float) -> None:
        """Count an accepted command.

        Args:
            neutral: Whether every input is released.
            tick: The tick that it echoes.
            now: The time.

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
        """Ask for released inputs before anything moves again."""
        self.armed = not self._needs_neutral
        self._neutral_since = None


WRITE_INTERVAL = 0.02
"""The shortest time between two moving commands on the wire, in seconds."""

WAIT_LIMIT = 0.05
"""The longest time that a moving command waits for its turn, in seconds. Only a gate
that stood still keeps one longer, and then it is too old to be written (S2)."""

RAMP_INTERVAL = 0.1
"""The longest time that the ramp counts between two commands, in seconds."""

ZERO = Twist()


@dataclass(frozen=True, slots=True)
class Bounds:
    """What a machine may do at most, now."""

    speed: Speed
    a_max: float | None
    holonomic: bool
    axes: Axes = PLANE


class Motion:
    """The velocities of one machine.

    Args:
        key: The machine.
        control: The link that they go to.
        bounds: Gives the bounds that hold now.
        guard: Gives what its scanners leave of a velocity that is about to be written.
        emit: Called with each action.

    """

    def __init__(
        self,
        key: Key,
        control: LinkHealth,
        bounds: Callable[[], Bounds],
        guard: Callable[[Twist, float], Twist],
        emit: Emit,
    ) -> None:
        self.driving = False
        self.sent = ZERO
        """What was written last."""
        self.owes_zero = False
        """Whether it may still move by our doing: it gets a zero in any case."""
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
        self._sent_at = self._moved_at = float("-inf")
        self.sent_epoch: int | None = None
        """On whose behalf that was, or the motion that it ended."""

    @property
    def stopping(self) -> bool:
        """Whether zeros are being written."""
        return self._burst.running

    @property
    def silent(self) -> bool:
        """Whether nothing is written now and nothing will be by itself."""
        return not (self.driving or self.stopping or self._left_alone)

    def drive(self, wanted: Twist, lease: Lease, now: float) -> None:
        """Write ``wanted``, within the bounds, on behalf of ``lease``."""
        if not self.driving:
            self._burst.end()
            self.driving = True
            self._owe_zero()
        self._pending = (wanted, lease, now)
        self._flush(now)

    def send_nothing(self) -> None:
        """Write nothing more, not even zero, though it moves (stop test only)."""
        self.driving, self._pending = False, None
        self._left_alone = True

    @property
    def moved_at(self) -> float:
        """When the machine was last told to move."""
        return self._moved_at

    def halt(self, now: float) -> None:
        """Go from driving to zeros; nothing happens if it was not driven."""
        if self.driving:
            self.zero(now)

    def zero(self, now: float, length: float | None = None) -> None:
        """Write zero at once, whatever was before, and for a moment from here on.

        Args:
            now: Seconds, monotonic.
            length: Seconds of that moment, in place of the usual ones.

        """
        if self.stopping and self._burst.started_at == now:
            return
        self.driving, self._pending, self._left_alone = False, None, False
        self._burst.start(now, length)
        self._write_zero_if_due(now)
        self._owe_zero()  # afterwards: no disk stands in the way of a stop

    def hold(self, now: float) -> None:
        """Write zero at once, and go on with that while STOP stands (S8)."""
        self.zero(now)
        self._held.start(now)

    def release_hold(self) -> None:
        """STOP stands no longer; nothing moves by that."""
        self._held.end()

    @property
    def held(self) -> bool:
        """Whether zeros are written because STOP stands."""
        return self._held.running

    def send_owed_zero(self, now: float) -> None:
        """Write the zero that is owed, now that there is a link again."""
        if self.owes_zero:
            self._burst.end()  # what it wrote just now went to the link before
            self.zero(now, NEW_LINK_LENGTH)

    def owe_zero(self) -> None:
        """Note that an earlier gate may have left the machine moving."""
        self._owe_zero()

    def step(self, now: float) -> None:
        """Write what is due."""
        self._flush(now)
        self._write_zero_if_due(now)
        answered = self._control.answered_since(self._burst.started_at)
        if self.owes_zero and self.silent and answered:
            # Only now are the zeros believed to have arrived.
            self.owes_zero = False
            self._emit(MarkDriven(self._key, False))

    def on_written(self, write: TwistWritten, now: float) -> None:
        """Note a velocity that went out."""
        self.sent, self._sent_at, self.sent_epoch = write.twist, now, write.epoch
        if not write.twist.is_zero:
            self._moved_at = now

    def _owe_zero(self) -> None:
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
        """Write the newest command, unless one has just been written."""
        if self._pending is None or now < self._tried_at + WRITE_INTERVAL:
            return
        wanted, lease, since = self._pending
        if now - since > WAIT_LIMIT:
            self._pending = None
            return
        if lease.epoch != self.sent_epoch and not self.sent.is_zero:
            self._write_zero()  # between two epochs there is a zero, whatever happened
            return
        self._pending, self._tried_at = None, now
        # The scanners judge what is written and nothing else: a ramp bends the way.
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
