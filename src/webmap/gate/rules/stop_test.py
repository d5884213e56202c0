"""The stop test: does the base stop by itself when commands end? (S12) No I/O.

::

    creeping ── odometry shows motion ──▶ waiting ── it stands for 0.3 s ──▶ done
        │                                    │
        └── no motion for 1.5 s              └── it moves on for 3 s
                    └──────────▶ failed ◀──────────┘
                                   ▲ any doubt, any key, STOP, another who commands it

While it creeps, each creeping command answers one of the driver's own, which say that
every input is released; the test writes nothing by a timer. While it waits nothing is
written at all, not even zero: that is what is tested. It always ends with zero.

One message that says "it stands" shows nothing: a coarse encoder says so between two of
its steps. The base stopped when a standstill began that lasted.
"""

from collections import Counter
from typing import Literal

from webmap.base.geometry import Twist
from webmap.gate.actions import Emit, SaveStopTest
from webmap.gate.commands import Refusal
from webmap.gate.events import Key
from webmap.gate.rules.health import Observation, Standstill, moves
from webmap.gate.rules.motion import Motion

CREEP = Twist(0.1)
"""How fast it creeps."""

CREEP_FOR = 1.5
"""Seconds within which odometry must show that it moves."""

MOVES = 0.05
"""Metres per second from which it moves."""

WAIT_FOR = 3.0
"""Seconds after the last command for which a base is waited for."""

NOT_ALONE = "another program sent commands: stop that program, then test again"
"""What is said when the gate was not the only one that commanded the base."""

MOVES_ON = f"the base did not stop within {WAIT_FOR:g} s"
"""What is said of a base that has no timeout of its own."""

State = Literal["creeping", "waiting", "done", "failed"]


class StopTest:
    """One test of one machine.

    Args:
        now: When it begins.

    """

    def __init__(self, now: float) -> None:
        self.state: State = "creeping"
        self.text = "moving slowly until odometry shows motion"
        self.concluded = False
        """Whether the base itself decided how it ended."""
        self.seconds: float | None = None
        """How long the base went on after the last command, if it stopped."""
        self._began_at = now
        self._left_alone_at = now
        self._still = Standstill()
        self._unechoed: Counter[Twist] = Counter()

    @property
    def running(self) -> bool:
        """Whether it goes on."""
        return self.state in ("creeping", "waiting")

    def on_written(self, twist: Twist) -> None:
        """Note what was written to the machine, of which an echo may come."""
        self._unechoed[twist] += 1

    def on_echo(self, twist: Twist) -> None:
        """Take in a velocity that was said to the machine, by whomever."""
        self._unechoed[twist] -= 1
        if self.state == "waiting" and self._unechoed[twist] < 0:
            self.abort(NOT_ALONE)

    def observe(self, twist: Twist | None, last_command_at: float, now: float) -> None:
        """Take in a message of odometry.

        Args:
            twist: The velocity that it tells, if it tells one.
            last_command_at: When the machine was last told to move.
            now: The time.

        """
        if twist is None:
            return
        if self.state == "creeping" and twist.speed > MOVES:
            self.state, self.text = (
                "waiting",
                "no more commands: waiting until the base stops",
            )
            self._left_alone_at = last_command_at
        elif self.state == "waiting":
            self._still.observe(twist, now)
            if self._still.reached:
                assert self._still.since is not None  # since when it stands
                self.state, self.concluded = "done", True
                self.seconds = round(self._still.since - self._left_alone_at, 3)
                self.text = f"the base stopped after {self.seconds:.2f} s"

    def step(self, now: float) -> None:
        """Let time pass."""
        if self.state == "creeping" and now - self._began_at >= CREEP_FOR:
            self.abort(f"the robot did not move within {CREEP_FOR:g} s")
        elif (
            self.state == "waiting"
            and now - self._left_alone_at >= WAIT_FOR
            and self._still.since is None  # else it may have stopped just now
        ):
            self.abort(MOVES_ON)
            self.concluded = True

    def abort(self, why: str) -> None:
        """End it without a result."""
        self.state, self.text = "failed", why


class StopTests:
    """Runs stop tests, one after the other.

    Args:
        key: The machine.
        motion: Writes to it.
        sight: What is heard of it.
        emit: Takes the actions.

    """

    def __init__(
        self, key: Key, motion: Motion, sight: Observation, emit: Emit
    ) -> None:
        self.last: StopTest | None = None
        """The last one, which may be going on."""
        self._key = key
        self._motion = motion
        self._observation = sight
        self._emit = emit

    @property
    def running(self) -> StopTest | None:
        """The one that is going on."""
        return self.last if self.last is not None and self.last.running else None

    def begin(self, armed: bool, now: float) -> None:
        """Begin one.

        Args:
            armed: Whether the driver's hands were seen to be off.
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
        self.last = StopTest(now)

    def on_written(self, twist: Twist) -> None:
        """Note what was written to the machine."""
        if self.running is not None:
            self.running.on_written(twist)

    def on_echo(self, twist: Twist, now: float) -> None:
        """Take in a velocity that came back on the topic, ours or another's."""
        test = self.running
        if test is not None:
            test.on_echo(twist)
            if not test.running:
                self._after(test, now)

    def observe(self, measured: Twist | None, now: float) -> None:
        """Take in a message of odometry."""
        test = self.running
        if test is not None:
            state = test.state
            test.observe(measured, self._motion.moved_at, now)
            if test.state != state:
                self._after(test, now)

    def step(self, now: float) -> None:
        """Let time pass."""
        test = self.running
        if test is not None:
            test.step(now)
            if not test.running:
                self._after(test, now)

    def _after(self, test: StopTest, now: float) -> None:
        """Do what the stop test has come to."""
        if test.state == "waiting":
            self._motion.send_nothing()
        else:
            self._motion.zero(now)
            if test.concluded:
                self._emit(SaveStopTest(self._key, test.seconds))

    def halt(self, why: str, now: float) -> None:
        """Go to zeros if it was driven or tested, for the reason in words."""
        test = self.running
        if test is not None:
            test.abort(why)
            self._motion.zero(now)
        self._motion.halt(now)
