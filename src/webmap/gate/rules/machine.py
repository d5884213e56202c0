"""One machine: who may move it, and when it must stop.

::

            take                 neutral 200 ms, then a command
    free ─────────▶ held ───────────────────────────────────────▶ driving
     ▲               ▲                                               │
     │ (no lease)    │ (lease)                                       │ release, doubt,
     └───────────────┴────────────── stopping ◀──────────────────────┘ lease ends, STOP
          silence after 500 ms       zeros at 20 Hz

Doubt (a link that does not answer, a display that is silent, odometry that does not
come) stops the machine and disarms its driver, whose hands must then be seen to be off.

STOP latches: from any state the machine gets zero and nobody has it, and it stays so
until a reset, which leads to *free*.
"""

from typing import Literal

from webmap.base.geometry import Twist
from webmap.gate.actions import Emit, Say
from webmap.gate.commands import Refusal
from webmap.gate.events import Key, LockState, Press, Wrote, WroteGoal
from webmap.gate.protocol import RobotSpec, SentTwist
from webmap.gate.rules.aliases import Robots
from webmap.gate.rules.assist import Guard
from webmap.gate.rules.authority import Arming, Hands
from webmap.gate.rules.connections import Epochs
from webmap.gate.rules.driving import Driving
from webmap.gate.rules.health import Health, Pulse, Sight
from webmap.gate.rules.motion import Motion
from webmap.gate.rules.obedience import EXPECTED_FOR, Obedience, OtherWriter
from webmap.gate.rules.speeds import Speeds
from webmap.gate.rules.stop import Latch, StandingStop
from webmap.gate.rules.stop_test import StopTesting

OWED_PATIENCE = 60.0
"""Seconds for which a robot that was removed is kept for a zero that it is owed. After
that the file on disk still says so, and whoever has the machine next sends it."""

State = Literal["free", "held", "driving", "stopping", "stopped"]


class Base:
    """The machine behind one velocity topic of one bridge.

    Args:
        key: The bridge and the topic.
        control: The link that velocity goes to.
        pulse: Whether the display is there.
        latch: Its STOP, which outlives it.
        epochs: The epochs to give to leases.
        emit: Takes the actions.

    """

    def __init__(
        self,
        key: Key,
        control: Health,
        pulse: Pulse,
        latch: Latch,
        epochs: Epochs,
        emit: Emit,
    ) -> None:
        self.key = key
        self.control = control
        self.latch = latch
        self.robots = Robots(key, emit)
        """The robots that this machine goes by."""
        self.known = False
        """Whether it was asked if this gate alone has it, and if STOP stands."""
        self.speeds = Speeds(self.robots, control)
        self.guard = Guard(self.robots)
        self.motion = Motion(key, control, self.speeds.bounds, self.guard.limit, emit)
        self.sight = Sight(key, emit)
        self.obedience = Obedience()
        self.other_writer = OtherWriter()
        self.tests = StopTesting(key, self.motion, self.sight, emit)
        self.arming = Arming(key, self.robots, latch, control, pulse, self.sight)
        self.hands = Hands(
            self.robots,
            self.arming,
            self.motion,
            self.speeds,
            epochs,
            self.tests.halt,
            self._update_watch,
        )
        self.driving = Driving(
            self.robots,
            self.hands,
            self.arming,
            self.motion,
            self.tests,
        )
        self.standing = StandingStop(key, latch, self.robots, control, self.motion)
        self._emit = emit
        self._left_at = float("-inf")

    @property
    def state(self) -> State:
        """What the machine does, as far as the gate has a hand in it."""
        if self.latch.acknowledged:
            return "stopped"
        if self.motion.driving:
            return "driving"
        if self.motion.stopping:
            return "stopping"
        return "free" if self.hands.lease is None else "held"

    @property
    def silent(self) -> bool:
        """Whether nothing is written now and nothing will be by itself."""
        return self.driving.silent

    @property
    def active(self) -> bool:
        """Whether time alone may make a difference."""
        return (
            self.hands.lease is not None
            or not self.silent
            or self.motion.owes_zero
            or self.latch.on
            or self.motion.held
            or self.hands.handover.going_on
            or self.sight.on
            or self.other_writer.seen is not None
        )

    # The robots that it is.

    def declare(
        self, spec: RobotSpec, tasks: Health, hooks: Health, now: float
    ) -> None:
        """Take in a robot, or what changed of it; a change ends the lease."""
        self.hands.end("the robot was declared again", now)
        self.robots.declare(spec, tasks, hooks, now)

    def attached(self, now: float) -> None:
        """Note that the robot can be spoken to, as soon as there are links."""
        if self.latch.on:
            self._say_stop(now)

    def forget(self, robot: str, now: float) -> None:
        """Drop a robot; the last one stays until its machine has stopped."""
        self.robots.leaving.add(robot)
        if not self.robots.holds_without(robot):
            self.hands.end(
                "the robot, or one on the same velocity topic, was removed", now
            )
        self.robots.goals[robot].lost(now)
        self._left_at = now
        self._drop_leaving(now)

    def _drop_leaving(self, now: float) -> None:
        # What may still move by our doing gets its zero first, if there is a link soon.
        patient = self.motion.owes_zero and now - self._left_at < OWED_PATIENCE
        for robot in list(self.robots.leaving):
            if len(self.robots.specs) == 1:
                if not self.silent or patient:
                    return
                self.sight.update(False)
            self.robots.drop(robot)

    def lost(self, connection: str, now: float) -> None:
        """A page is gone: what it drove stops."""
        self.hands.release(connection, now)
        for goals in self.robots.goals.values():
            goals.lost(now, connection)

    # STOP.

    def stop(self, press: Press, now: float) -> None:
        """STOP: zero at once, whoever drives it or nobody; no lease, no goals."""
        self.hands.end(f"STOP by {press.by}", now)
        self.standing.press(press, now)
        self._expect_standstill(now)

    def saw_stop_file(self, press: Press | None, now: float) -> None:
        """Note that the file of its STOP changed by another hand."""
        lock = self.arming.lock
        if self.standing.saw_file(press, lock.elsewhere) and press is not None:
            self.hands.end(f"STOP by {press.by}", now)
            self.standing.take_over(press, now)
            self._expect_standstill(now)

    def _say_stop(self, now: float) -> None:
        self.standing.say_all(now)
        self._expect_standstill(now)

    def _expect_standstill(self, now: float) -> None:
        self.obedience.expect(now, firmly=True)
        self._update_watch(now)

    def reset(self, stop: str, now: float) -> None:
        """End the STOP that stands; nothing moves by that, and nobody has it.

        Args:
            stop: The identity of the STOP that is to be ended.
            now: The time.

        Raises:
            Refusal: If none stands, a newer one does, or another gate has the machine.

        """
        if self.arming.lock.elsewhere:
            raise Refusal(f"{self.arming.lock.why}: reset its STOP there")
        self.standing.reset(stop)
        self._update_watch(now)

    def step(self, now: float) -> None:
        """Let time have its say."""
        self.driving.step(now)
        self.speeds.ages.forget_old(now)
        self.hands.step(now)
        self.motion.step(now)
        self.other_writer.step(now)
        if self.latch.on:
            self.standing.confirm(now)
        self._update_watch(now)
        self._drop_leaving(now)

    # What is heard of it.

    def wrote_goal(self, write: WroteGoal) -> None:
        """Note that a goal went out: what moves from here on moves by itself."""
        self.robots.goals[write.robot].wrote(write)
        self.obedience.excuse()

    def wrote(self, write: Wrote, now: float) -> None:
        """Note what became of a velocity."""
        if not write.done:
            return
        self.obedience.wrote(write.twist, self.motion.sent, now)
        self.motion.wrote(write, now)
        self.tests.wrote(write.twist)
        self.other_writer.wrote(write.twist, now)
        vx, vy, wz, *others = write.twist.numbers
        for robot in self.robots.specs:
            self._emit(Say(SentTwist(robot, vx, vy, wz, write.by, *others)))

    def heard(self, twist: Twist, now: float) -> None:
        """Note what came back on the velocity topic, ours or another's."""
        self.sight.saw_echo(twist)
        self.tests.heard(twist, now)
        if self.arming.lock.elsewhere or self.robots.follow_goals:
            # Another gate on this computer drives it, or what follows its goal does.
            self.other_writer.expect(now + EXPECTED_FOR)
        self.other_writer.heard(twist, now)

    def saw(self, measured: Twist | None, said_after: float, now: float) -> None:
        """Note that odometry came, which was said after a moment, maybe long ago."""
        if not self.sight.on:
            return
        measured = self.robots.axes.seen(measured)
        self.sight.saw(measured, said_after, now)
        seen, handover = self.standing.confirmation, self.hands.handover
        if self.latch.on and self.sight.tells_since(seen.since):
            seen.saw(measured, now)
        if handover.heir is not None and self.sight.tells_since(handover.since):
            handover.saw(measured, now)
        self.obedience.saw(measured, now)
        self.tests.saw(measured, now)

    def locked(self, lock: LockState, now: float) -> None:
        """Note whether this gate alone has the machine."""
        self.arming.lock, self.known, self.speeds.tested = lock, True, lock.tested
        if lock.driven:
            self.motion.owe_from_before()
            self.link_up(now)
        if lock.held and lock.latched is not None and self.latch.is_news(lock.latched):
            self.latch.found(lock.latched)
            self._say_stop(now)

    def link_up(self, now: float) -> None:
        """A zero that may not have arrived goes first."""
        if not self.control.up:
            return
        # What an earlier gate, or an earlier link, wrote may be heard still.
        self.other_writer.expect(now + EXPECTED_FOR)
        if self.motion.owes_zero:
            self.obedience.expect(now)  # also of an earlier gate, whose word was motion
        self.motion.pay(now)
        if self.latch.on:
            self._say_stop(now)

    def link_down(self, now: float) -> None:
        """The control link is gone."""
        self.driving.link_down(f"no connection to {self.key.url}", now)

    def _update_watch(self, now: float) -> None:
        self.sight.update(
            self.hands.lease is not None
            or not self.silent
            or self.latch.on
            or self.hands.handover.heir is not None
            or (self.robots.has_odometry and self.obedience.watching(now))
        )
        if not self.sight.on:
            self.guard.forget()
