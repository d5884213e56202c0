"""The stop test: does the base stop by itself when commands end? (S12) No I/O.

::

    creeping ── odometry shows motion ──▶ waiting ── standstill for 0.3 s ──▶ done
        │                                    │
        └── no motion for 1.5 s              └── still moving after 3 s
                    └──────────▶ failed ◀──────────┘
                                   ▲ any fault, any input, STOP, another program

While the state is ``creeping``, each creeping command answers a command of the driver
with all inputs released; the test writes nothing by a timer. While the state is
``waiting``, the gate writes nothing at all, not even zero: that is what is tested. The
test always ends with zero.

One odometry message without motion proves nothing: a coarse encoder sends such messages
between two of its steps. The base stopped when the first lasting standstill began.

The measured time may be too long: by the time between two messages of odometry, and by
the round trip, as the last command and the odometry were on their way.
"""

from collections import Counter
from typing import Literal

from webmap.base.geometry import Twist
from webmap.gate.actions import Emit, SaveStopTest
from webmap.gate.commands import Refusal
from webmap.gate.events import Key
from webmap.gate.rules.health import Ages, Observation, Standstill, moves
from webmap.gate.rules.motion import Motion

CREEP = Twist(0.1)
"""The velocity while the state is ``creeping``."""

CREEP_FOR = 1.5
"""Seconds within which odometry must show motion."""

MOVES = 0.05
"""Metres per second above which the base moves."""

WAIT_FOR = 3.0
"""Seconds after the last command within which the base must stop."""

NOT_ALONE = "another program sent commands: stop that program, then test again"
"""The result if another program commanded the base too."""

MOVES_ON = f"the base did not stop within {WAIT_FOR:g} s"
"""The result for a base without a command timeout."""

State = Literal["creeping", "waiting", "done", "failed"]


class MachineTest:
    """One stop test of one machine.

    Args:
        now: The time, at which the test begins.

    """

    def __init__(self, now: float) -> None:
        self.state: State = "creeping"
        self.text = "moving slowly until odometry shows motion"
        self.concluded = False
        """Whether the test ended with a result: the base stopped, or did not."""
        self.seconds: float | None = None
        """Seconds from the last command until the base stopped, if it did."""
        self.error = 0.0
        """Seconds by which that may be too long."""
        self._began_at = now
        self._last_command_at = self._moving_at = now
        self._still = Standstill()
        self._unechoed: Counter[Twist] = Counter()

    @property
    def running(self) -> bool:
        """Whether the robot creeps, or the time until it stops is being measured."""
        return self.state in ("creeping", "waiting")

    def on_written(self, twist: Twist) -> None:
        """Note a velocity that the gate wrote; its echo may follow."""
        self._unechoed[twist] += 1

    def on_echo(self, twist: Twist) -> None:
        """Process a velocity on the topic, of the gate or of another program."""
        self._unechoed[twist] -= 1
        if self.state == "waiting" and self._unechoed[twist] < 0:
            self.abort(NOT_ALONE)

    def observe(
        self, twist: Twist | None, last_command_at: float, trip: float, now: float
    ) -> None:
        """Process an odometry message.

        Args:
            twist: The velocity in the message, if it has one.
            last_command_at: When the last velocity other than zero was written.
            trip: Seconds to the bridge of the base and back.
            now: The time.

        """
        if twist is None:
            return
        if self.state == "creeping" and twist.speed > MOVES:
            self.state, self.text = (
                "waiting",
                "no more commands: waiting until the base stops",
            )
            self._last_command_at, self._moving_at = last_command_at, now
        elif self.state == "waiting":
            self._still.observe(twist, now)
            since = self._still.since
            if since is None:
                self._moving_at = now
            elif self._still.reached:
                self.state, self.concluded = "done", True
                self.seconds = round(since - self._last_command_at, 3)
                self.error = round(min(since - self._moving_at + trip, self.seconds), 3)
                self.text = (
                    f"the base stopped after {self.seconds:.2f} s, or up to "
                    f"{self.error:.2f} s sooner (error of the measurement)"
                )

    def step(self, now: float) -> None:
        """Fail a test that exceeds its time limits."""
        if self.state == "creeping" and now - self._began_at >= CREEP_FOR:
            self.abort(f"the robot did not move within {CREEP_FOR:g} s")
        elif (
            self.state == "waiting"
            and now - self._last_command_at >= WAIT_FOR
            and self._still.since is None  # else it may have stopped just now
        ):
            self.abort(MOVES_ON)
            self.concluded = True

    def abort(self, why: str) -> None:
        """End the test without a result."""
        self.state, self.text = "failed", why


class StopTests:
    """Runs the stop tests of one machine, one after the other.

    Args:
        key: The machine.
        motion: Writes its velocities.
        sight: Its newest odometry.
        trips: The round trips of pings to its bridge.
        emit: Called with each action.

    """

    def __init__(
        self, key: Key, motion: Motion, sight: Observation, trips: Ages, emit: Emit
    ) -> None:
        self.last: MachineTest | None = None
        """The newest test, which may be running."""
        self._key = key
        self._motion = motion
        self._observation = sight
        self._trips = trips
        self._emit = emit

    @property
    def running(self) -> MachineTest | None:
        """The test that has not ended, if there is one."""
        return self.last if self.last is not None and self.last.running else None

    def begin(self, armed: bool, now: float) -> None:
        """Begin a test.

        Args:
            armed: Whether the driver has released all inputs.
            now: The time.

        Raises:
            Refusal: If the machine cannot be tested now.

        """
        if not armed or not self._motion.silent:
            raise Refusal("release all inputs first")
        measured = self._observation.measured
        if measured is None:
            raise Refusal("no odometry: the stop test needs odometry")
        if moves(measured):
            raise Refusal("the robot is already moving")
        self.last = MachineTest(now)

    def on_written(self, twist: Twist) -> None:
        """Note a velocity that the gate wrote."""
        if self.running is not None:
            self.running.on_written(twist)

    def on_echo(self, twist: Twist, now: float) -> None:
        """Process a velocity on the topic, of the gate or of another program."""
        test = self.running
        if test is not None:
            test.on_echo(twist)
            if not test.running:
                self._apply_state(test, now)

    def observe(self, measured: Twist | None, now: float) -> None:
        """Process an odometry message."""
        test = self.running
        if test is not None:
            state = test.state
            trip = self._trips.p95 or 0.0
            test.observe(measured, self._motion.moved_at, trip, now)
            if test.state != state:
                self._apply_state(test, now)

    def step(self, now: float) -> None:
        """Apply the time limits of the running test."""
        test = self.running
        if test is not None:
            test.step(now)
            if not test.running:
                self._apply_state(test, now)

    def _apply_state(self, test: MachineTest, now: float) -> None:
        """Do what the new state of ``test`` requires."""
        if test.state == "waiting":
            self._motion.send_nothing()
        else:
            self._motion.zero(now)
            if test.concluded:
                self._emit(SaveStopTest(self._key, test.seconds, test.error))

    def halt(self, why: str, now: float) -> None:
        """Send zeros if the machine was driven or tested; ``why`` is the reason."""
        test = self.running
        if test is not None:
            test.abort(why)
            self._motion.zero(now)
        self._motion.halt(now)
