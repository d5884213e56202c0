"""The stop tests of one machine, and how it is halted while one goes on. No I/O."""

from webmap.base.geometry import Twist
from webmap.gate.actions import Emit, KeepStopTest
from webmap.gate.events import Key
from webmap.gate.refusal import Refusal
from webmap.gate.rules.motion import Motion
from webmap.gate.rules.sight import Sight
from webmap.gate.rules.standstill import moves
from webmap.gate.rules.stoptest import StopTest


class StopTesting:
    """Runs stop tests, one after the other.

    Args:
        key: The machine.
        motion: Writes to it.
        sight: What is heard of it.
        emit: Takes the actions.

    """

    def __init__(self, key: Key, motion: Motion, sight: Sight, emit: Emit) -> None:
        self.last: StopTest | None = None
        """The last one, which may be going on."""
        self._key = key
        self._motion = motion
        self._sight = sight
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
        measured = self._sight.measured
        if measured is None:
            raise Refusal("no odometry: the stop test needs odometry")
        if moves(measured):
            raise Refusal("the robot is already moving")
        self.last = StopTest(now)

    def wrote(self, twist: Twist) -> None:
        """Note what was written to the machine."""
        if self.running is not None:
            self.running.wrote(twist)

    def heard(self, twist: Twist, now: float) -> None:
        """Take in a velocity that came back on the topic, ours or another's."""
        test = self.running
        if test is not None:
            test.heard(twist)
            if not test.running:
                self._after(test, now)

    def saw(self, measured: Twist | None, now: float) -> None:
        """Take in a message of odometry."""
        test = self.running
        if test is not None:
            state = test.state
            test.saw(measured, self._motion.moved_at, now)
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
            self._motion.leave_alone()
        else:
            self._motion.zero(now)
            if test.concluded:
                self._emit(KeepStopTest(self._key, test.seconds))

    def halt(self, why: str, now: float) -> None:
        """Go to zeros if it was driven or tested, for the reason in words."""
        test = self.running
        if test is not None:
            test.abort(why)
            self._motion.zero(now)
        self._motion.halt(now)
