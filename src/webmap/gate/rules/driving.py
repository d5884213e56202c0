"""Turns the commands of a machine's holder into motion, goals and tests. No I/O."""

from webmap.base.geometry import Twist
from webmap.gate.commands import Refusal
from webmap.gate.rules.aliases import Aliases
from webmap.gate.rules.authority import Authority, MotionConditions
from webmap.gate.rules.connections import Lease
from webmap.gate.rules.motion import Motion
from webmap.gate.rules.stop_test import CREEP, MachineTest, StopTests


class Driving:
    """Executes the accepted commands for one machine, and stops it on any fault.

    Args:
        robots: The robots of the machine.
        authority: Who has control of it.
        conditions: The conditions for its motion.
        motion: Writes its velocities.
        tests: Its stop tests.

    """

    def __init__(
        self,
        robots: Aliases,
        authority: Authority,
        conditions: MotionConditions,
        motion: Motion,
        tests: StopTests,
    ) -> None:
        self._robots = robots
        self._authority = authority
        self._conditions = conditions
        self._motion = motion
        self._tests = tests

    def drive(self, wanted: Twist, neutral: bool, tick: int, now: float) -> str | None:
        """Execute an accepted command of the holder.

        Args:
            wanted: The velocity asked for, not yet limited.
            neutral: Whether every input is released.
            tick: The tick that the command echoes.
            now: Seconds, monotonic.

        Returns:
            Why the machine does not move although the command asks for motion, or
            ``None``.

        """
        lease = self._authority.lease
        assert lease is not None
        if reason := self._conditions.why_blocked(now):
            self._fault(reason, now)
            return None if neutral else reason
        self._authority.deadman.accept(neutral, tick, now)
        if self._authority.deadman.expired(now):
            self._disarm_and_halt("the page received no message from the gate", now)
            return None if neutral else "no message from the gate: release all inputs"
        if self._tests.running is not None:
            return self._go_on_with_test(self._tests.running, lease, neutral, now)
        if neutral or not self._authority.deadman.armed:
            self._motion.halt(now)
            return None if neutral else "release all inputs first"
        if reason := self._conditions.why_not_driven(now):
            self._motion.halt(now)
            return reason
        self._drive(wanted, lease, now)
        return None

    @property
    def silent(self) -> bool:
        """Whether no velocity is written now, nor later without a new event."""
        return self._motion.silent and self._tests.running is None

    def _drive(self, wanted: Twist, lease: Lease, now: float) -> None:
        self._authority.renew(now)
        if not self._motion.driving:
            self._robots.cancel_for_driving(now)
        self._motion.drive(wanted, lease, now)

    def late(self, now: float) -> None:
        """Write zero, because a command of the holder was too old (S1).

        Its content does not matter: the delay is too long for safe driving.
        """
        self._disarm_and_halt("the commands of the page are too old", now)

    def begin_test(self, now: float) -> None:
        """Begin the stop test for the holder.

        Raises:
            Refusal: If the machine cannot be tested now.

        """
        if self._tests.running is not None:
            raise Refusal("a stop test is running")
        if reason := self._conditions.why_blocked(now):
            raise Refusal(reason)
        self._tests.begin(self._authority.deadman.armed, now)

    def _go_on_with_test(
        self, test: MachineTest, lease: Lease, neutral: bool, now: float
    ) -> str | None:
        if not neutral:
            self._disarm_and_halt("an input was used", now)
            return "a stop test was running: release all inputs first"
        if not self._authority.deadman.armed:
            self._disarm_and_halt("the page stopped sending commands", now)
        if test.state == "creeping":
            self._drive(CREEP, lease, now)
        return None

    def goal(
        self, robot: str, pose: tuple[float, float, float], by: str, now: float
    ) -> None:
        """Send a goal to the robot; that ends driving.

        Args:
            robot: The robot.
            pose: x, y and yaw in the robot's goal frame, in metres and radians.
            by: The connection that sends the goal.
            now: Seconds, monotonic.

        Raises:
            Refusal: If no goal can be sent now.

        """
        if reason := self._authority.why_unavailable(now):
            raise Refusal(reason)
        self._disarm_and_halt("a goal was sent", now)
        self._robots.goals[robot].send(*pose, by, now)
        self._authority.renew(now)

    def locate(
        self, robot: str, pose: tuple[float, float, float], by: str, now: float
    ) -> None:
        """Send the robot its own pose, while nothing moves it.

        Args:
            robot: The robot.
            pose: x, y and yaw in the robot's goal frame, in metres and radians.
            by: The connection that sends the pose.
            now: Seconds, monotonic.

        Raises:
            Refusal: If no pose can be sent now.

        """
        if reason := self._authority.why_unavailable(now):
            raise Refusal(reason)
        if not self.silent:
            raise Refusal("the robot is moving: stop it first")
        self._robots.goals[robot].locate(*pose, by, now)
        self._authority.renew(now)

    def link_down(self, why: str, now: float) -> None:
        """Stop, because the link that carries velocities is closed."""
        if self._authority.lease is not None:
            self._fault(why, now)

    def step(self, now: float) -> None:
        """Check the conditions and the dead-man timeout, and continue a stop test."""
        if self._authority.lease is not None:
            if reason := self._conditions.why_blocked(now):
                self._fault(reason, now)
            elif self._authority.deadman.expired(now):
                self._disarm_and_halt("the page stopped sending commands", now)
        self._tests.step(now)

    def _disarm_and_halt(self, why: str, now: float) -> None:
        self._authority.deadman.disarm()
        self._tests.halt(why, now)

    def _fault(self, reason: str, now: float) -> None:
        """Stop and disarm because of a fault; end the lease of a program."""
        self._disarm_and_halt(reason, now)
        lease = self._authority.lease
        if lease is None or not lease.program:
            return
        # A program has no inputs that it could release. So once it has driven, it must
        # take control again: it may have hung together with its display, and would
        # continue where it was.
        if self._motion.sent_epoch == lease.epoch:
            self._authority.end(reason, now)
