"""One machine: who may move it, and when it must stop. No I/O.

::

            take                 neutral 200 ms, then a command
    free ─────────▶ held ───────────────────────────────────────▶ driving
     ▲               ▲                                               │
     │ (no lease)    │ (lease)                                       │ neutral, fault,
     └───────────────┴────────────── stopping ◀──────────────────────┘ lease ends, STOP
          silence after 500 ms       zeros at 20 Hz

A fault (a link that does not answer, a silent display, missing odometry) stops the
machine and disarms its dead-man; the operator must then release all inputs.

STOP latches: from any state the machine gets zero and the lease ends. It stays so until
a reset, which leads to *free*.
"""

import math
from typing import Literal

from webmap.base.geometry import Twist
from webmap.base.text import isolated
from webmap.gate.actions import Emit, SendToDisplay
from webmap.gate.commands import Refusal
from webmap.gate.events import GoalWritten, Key, LockState, Press, TwistWritten
from webmap.gate.protocol import RobotSpec, SentTwist
from webmap.gate.rules.aliases import Aliases
from webmap.gate.rules.assist import ScanAssist
from webmap.gate.rules.authority import Authority, MotionConditions
from webmap.gate.rules.check import PreDriveCheck
from webmap.gate.rules.connections import Epochs
from webmap.gate.rules.delivery import Delivery
from webmap.gate.rules.driving import Driving
from webmap.gate.rules.health import DisplayPulse, LinkHealth, Observation
from webmap.gate.rules.motion import HELD_PERIOD, Motion
from webmap.gate.rules.obedience import EXPECTED_FOR, Obedience, OtherWriter
from webmap.gate.rules.speeds import MachineSpeeds
from webmap.gate.rules.stop import ActiveStop, StopLatch
from webmap.gate.rules.stop_test import StopTests

OWED_PATIENCE = 60.0
"""Seconds for which a removed robot is kept because a zero is owed to it.

After that, the file on disk still records the owed zero, and the next gate that has the
machine sends it.
"""

State = Literal["free", "held", "driving", "stopping", "stopped"]


class Machine:
    """The machine behind one velocity topic of one bridge.

    Args:
        key: The bridge and the topic.
        control: The link that carries velocities.
        pulse: Whether the display is alive.
        latch: Its STOP, which outlives this object.
        epochs: Gives the epochs of leases.
        emit: Called with each action.

    """

    def __init__(
        self,
        key: Key,
        control: LinkHealth,
        pulse: DisplayPulse,
        latch: StopLatch,
        epochs: Epochs,
        emit: Emit,
    ) -> None:
        self.key = key
        self.control = control
        self.latch = latch
        self.robots = Aliases(key, emit)
        """The robots that are declared for this machine."""
        self.known = False
        """Whether the shell has reported the lock, and whether STOP is active."""
        self.check = PreDriveCheck(key, self.robots, emit)
        self.speeds = MachineSpeeds(self.robots, control, self.check)
        self.scan_assist = ScanAssist(self.robots)
        self.delivery = Delivery(key, control)
        self.motion = Motion(
            key, self.delivery, self.speeds.bounds, self.scan_assist.limit, emit
        )
        self.observation = Observation(key, emit)
        self.obedience = Obedience()
        self.other_writer = OtherWriter()
        self.tests = StopTests(key, self.motion, self.observation, control.trips, emit)
        self.conditions = MotionConditions(
            key,
            self.robots,
            latch,
            self.delivery,
            self.speeds,
            pulse,
            self.observation,
        )
        self.authority = Authority(
            self.robots,
            self.conditions,
            self.motion,
            self.speeds,
            epochs,
            self.tests.halt,
            self._update_watch,
        )
        self.driving = Driving(
            self.robots,
            self.authority,
            self.conditions,
            self.motion,
            self.tests,
        )
        self.active_stop = ActiveStop(
            key, latch, self.robots, self.delivery, self.motion
        )
        self._emit = emit
        self._left_at = float("-inf")
        self.reported: tuple[object, ...] | None = None
        """What :meth:`shown` returned when it was reported last, sent or not."""
        self.reported_at = -math.inf
        self.due_at = -math.inf
        """When its next step is due; at 10 Hz while the machine rests."""

    @property
    def state(self) -> State:
        """The state of the machine for the gate; see the diagram of the module."""
        if self.latch.acknowledged:
            return "stopped"
        if self.motion.driving:
            return "driving"
        if self.motion.stopping:
            return "stopping"
        return "free" if self.authority.lease is None else "held"

    @property
    def silent(self) -> bool:
        """Whether no velocity is written now, nor later without a new event."""
        return self.driving.silent

    @property
    def active(self) -> bool:
        """Whether :meth:`step` has anything to do."""
        return (
            self.authority.lease is not None
            or not self.silent
            or self.motion.owes_zero
            or self.latch.on
            or self.motion.held
            or self.authority.handover.going_on
            or self.observation.on
            or self.other_writer.seen is not None
            or any(goals.waits for goals in self.robots.goals.values())
        )

    @property
    def rests(self) -> bool:
        """Whether a STOP is active, and nobody has control or moves the machine."""
        return (
            self.latch.on
            and self.authority.lease is None
            and (self.silent or self.motion.stopping)
            and not self.authority.handover.going_on
        )

    def next_step(self, now: float) -> float:
        """Return when :meth:`step` is due, after a step or an event at ``now``."""
        if not self.rests:
            return -math.inf
        before = math.inf if self.due_at == -math.inf else self.due_at
        return min(before, self.motion.zero_at, now + HELD_PERIOD)

    def shown(self, now: float) -> tuple[object, ...]:
        """Return the values of reports that change without an event for the machine."""
        seen, sight = self.active_stop.confirmation, self.observation
        return (
            (self.state, seen.confirmed, seen.why, self.obedience.alarm(now)),
            (sight.echoed, sight.shown(now), self.motion.owes_zero),
            (self.other_writer.seen, self.other_writer.nodes),
            *(goals.report for goals in self.robots.goals.values()),
        )

    def involves(self, connection: str) -> bool:
        """Return whether a connection has or wants control, or sent a goal."""
        return self.authority.involves(connection) or any(
            goals.is_by(connection) for goals in self.robots.goals.values()
        )

    # The robots of the machine.

    def declare(
        self, spec: RobotSpec, tasks: LinkHealth, hooks: LinkHealth, now: float
    ) -> None:
        """Add a robot or update its declaration; both end the lease."""
        self.authority.end("the configuration of the robot was changed", now)
        self.robots.declare(spec, tasks, hooks, now)
        self.check.look(now)

    def attached(self, now: float) -> None:
        """Send an active STOP to a robot that was just added."""
        if self.latch.on:
            self._send_stop(now)

    def forget(self, robot: str, now: float) -> None:
        """Remove a robot; the last one stays until the machine has stopped."""
        self.robots.leaving.add(robot)
        if not self.robots.holds_without(robot):
            self.authority.end(
                "the robot, or another with the same velocity topic, was removed", now
            )
        self.robots.goals[robot].lost(now)
        self._left_at = now
        self._drop_leaving(now)

    def _drop_leaving(self, now: float) -> None:
        # A machine that this gate may have left moving gets its zero first, if there is
        # a link soon enough.
        patient = self.motion.owes_zero and now - self._left_at < OWED_PATIENCE
        for robot in list(self.robots.leaving):
            if len(self.robots.specs) == 1:
                if not self.silent or patient:
                    return
                self.observation.update(False)
            self.robots.drop(robot)

    def lost(self, connection: str, now: float) -> None:
        """Release the control of a page that is gone; its goals may be cancelled."""
        self.authority.release(connection, now)
        for goals in self.robots.goals.values():
            goals.lost(now, connection)

    # STOP.

    def stop(self, press: Press, now: float) -> None:
        """Activate STOP: write zero at once, end the lease, cancel the goals."""
        self.authority.end(f"STOP by {isolated(press.by)}", now)
        self.active_stop.press(press, now)
        self._expect_standstill(now)

    def on_stop_file_changed(self, press: Press | None, now: float) -> None:
        """Take over a STOP that another process wrote to the machine's file."""
        lock = self.conditions.lock
        if (
            self.active_stop.on_file_changed(press, lock.elsewhere)
            and press is not None
        ):
            self.authority.end(f"STOP by {isolated(press.by)}", now)
            self.active_stop.take_over(press, now)
            self._expect_standstill(now)

    def _send_stop(self, now: float) -> None:
        self.active_stop.send_all(now)
        self._expect_standstill(now)

    def _expect_standstill(self, now: float) -> None:
        self.obedience.expect(now, firmly=True)
        self.observation.update(True)  # a ping at once: its answer proves the zero
        self._update_watch(now)

    def reset(self, stop: str, now: float) -> None:
        """End the active STOP; nothing moves, and no operator has control.

        Args:
            stop: The identity of the STOP to end.
            now: Seconds, monotonic.

        Raises:
            Refusal: If no STOP or a newer STOP is active, or another gate has the
                machine.

        """
        if self.conditions.lock.elsewhere:
            raise Refusal(f"{self.conditions.lock.why}: reset the STOP there")
        proved = self.active_stop.proved
        self.active_stop.reset(stop)
        self.check.prove(proved, now)
        self._update_watch(now)

    def step(self, now: float) -> None:
        """Do what is due at ``now``."""
        self.driving.step(now)
        self.speeds.ages.forget_old(now)
        self.authority.step(now)
        self.motion.step(now)
        self.other_writer.step(now)
        for goals in self.robots.goals.values():
            goals.step(now)
        if self.latch.on:
            self.active_stop.confirm(now)
        self._update_watch(now)
        self._drop_leaving(now)

    # Events of the shell.

    def on_goal_written(self, write: GoalWritten, now: float) -> None:
        """Note that a goal was written: from now on the robot may move by itself."""
        self.robots.goals[write.robot].on_written(write, now)
        self.obedience.excuse()

    def on_written(self, write: TwistWritten, now: float) -> None:
        """Note the result of writing a velocity."""
        if not write.done:
            return
        self.obedience.on_written(write.twist, self.motion.sent, now)
        self.motion.on_written(write, now)
        self.tests.on_written(write.twist)
        self.other_writer.on_written(write.twist, now)
        self.delivery.on_written(write.twist, now)
        vx, vy, wz, *others = write.twist.numbers
        for robot in self.robots.specs:
            self._emit(SendToDisplay(SentTwist(robot, vx, vy, wz, write.by, *others)))

    def on_echo(self, twist: Twist, now: float) -> None:
        """Note a velocity received on the topic, of this gate or another writer."""
        self.observation.on_echo(twist)
        self.delivery.on_echo(twist, now)
        self.tests.on_echo(twist, now)
        if self.conditions.lock.elsewhere or self.robots.follow_goals:
            # Another gate on this computer, or the navigation of a goal, writes too.
            self.other_writer.expect(now + EXPECTED_FOR)
        self.other_writer.on_echo(twist, now)

    def observe(self, measured: Twist | None, sent_after: float, now: float) -> None:
        """Note a message of odometry.

        Args:
            measured: The velocity, if the message had a valid one.
            sent_after: The bridge sent the message after this moment, which may be long
                ago.
            now: Seconds, monotonic.

        """
        if not self.observation.on:
            return
        measured = self.robots.axes.seen(measured)
        self.observation.observe(measured, sent_after, now)
        seen, handover = self.active_stop.confirmation, self.authority.handover
        if self.latch.on:
            if self.observation.shows_since(seen.since):
                seen.observe(measured, now)
            self.active_stop.confirm(now)  # the next step may be 100 ms away
        if handover.successor is not None and self.observation.shows_since(
            handover.since
        ):
            handover.observe(measured, now)
        zeros = self.motion.stopping or self.motion.held
        contested = zeros and self.other_writer.seen is not None
        self.obedience.observe(measured, now, contested=contested)
        self.tests.observe(measured, now)

    def locked(self, lock: LockState, now: float) -> None:
        """Note whether this gate alone has the machine."""
        self.conditions.lock, self.known, self.speeds.tested = lock, True, lock.tested
        self.check.take(lock.checked, now)
        if lock.driven:
            self.motion.owe_zero()
            self._begin_link(now)
        if lock.held and lock.latched is not None and self.latch.is_new(lock.latched):
            self.latch.found(lock.latched)
            self._send_stop(now)

    def link_up(self, now: float) -> None:
        """Begin a new connection of the control link."""
        self.delivery.opened()
        self._begin_link(now)

    def _begin_link(self, now: float) -> None:
        """Send an owed zero first, then an active STOP, if the control link is open."""
        if not self.control.up:
            return
        # Velocities of an earlier gate or an earlier link may still arrive as echoes.
        self.other_writer.expect(now + EXPECTED_FOR)
        if self.motion.owes_zero:
            self.obedience.expect(now)  # also when an earlier gate wrote the motion
        self.motion.send_owed_zero(now)
        if self.latch.on:
            self._send_stop(now)

    def link_down(self, now: float) -> None:
        """Stop, because the control link is closed."""
        self.driving.link_down(f"no connection to {self.key.url}", now)

    def _update_watch(self, now: float) -> None:
        self.check.look(now)  # also whenever somebody gets control
        self.observation.update(
            self.authority.lease is not None
            or self.latch.on
            or not self.silent
            or self.authority.handover.successor is not None
            or (self.robots.has_odometry and self.obedience.watching(now)),
            often=not self.rests,
        )
        if not self.observation.on:
            self.scan_assist.forget()
