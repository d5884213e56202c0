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

from webmap.gate.actions import Emit, KeepStopTest, Say
from webmap.gate.arming import Arming
from webmap.gate.connection import Connection
from webmap.gate.deadman import DeadMan
from webmap.gate.events import Key, LatchKept, LockState, StopRecord, Wrote, WroteGoal
from webmap.gate.guard import Guard
from webmap.gate.handover import HandOver
from webmap.gate.health import Health, Pulse
from webmap.gate.latch import Latch
from webmap.gate.lease import Epochs, Lease
from webmap.gate.limits import Cap, Speed, caps_of, fit, speed_in_force
from webmap.gate.loopage import LoopAge, governed
from webmap.gate.messages import RobotSpec, SentTwist
from webmap.gate.motion import Bounds, Motion
from webmap.gate.obedience import Obedience
from webmap.gate.refusal import Refusal
from webmap.gate.robots import Robots
from webmap.gate.sight import Sight
from webmap.gate.standing import StandingStop
from webmap.gate.standstill import STILL_V, speed_of
from webmap.gate.stoptest import CREEP, StopTest
from webmap.gate.video import Video
from webmap.geometry import Twist

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
        self.lease: Lease | None = None
        self.handover = HandOver()
        self.deadman = DeadMan()
        self.ages = LoopAge()
        self.obedience = Obedience()
        self.test: StopTest | None = None
        """The last stop test, which may be going on."""
        self.tested: StopRecord | None = None
        """What the last stop test that came to an end found, whenever that was."""
        self.motion = Motion(key, control, self._bounds, emit)
        self.standing = StandingStop(key, latch, self.robots, control, self.motion)
        self.sight = Sight(key, emit)
        self.video = Video()
        self.guard = Guard(self.robots)
        self.arming = Arming(key, self.robots, latch, control, pulse, self.sight)
        self.known = False
        """Whether it was asked if this gate alone has it, and if STOP stands."""
        self._epochs = epochs
        self._emit = emit
        self._page_cap: Cap | None = None

    @property
    def state(self) -> State:
        """What the machine does, as far as the gate has a hand in it."""
        if self.latch.acknowledged:
            return "stopped"
        if self.motion.driving:
            return "driving"
        if self.motion.stopping:
            return "stopping"
        return "free" if self.lease is None else "held"

    @property
    def speed(self) -> Speed:
        """The speeds in force now."""
        specs = self.robots.specs.values()
        caps = [cap for spec in specs for cap in caps_of(spec, self.tested)]
        if self._page_cap is not None:
            caps.append(self._page_cap)
        return governed(speed_in_force(caps), self.ages.slow, self.stop_time)

    @property
    def stop_time(self) -> float | None:
        """Seconds within which the machine stops by itself, if that is known."""
        if self.tested is not None:
            return self.tested.seconds
        return self.robots.stops_within

    def _bounds(self) -> Bounds:
        return Bounds(self.speed, self.robots.a_max, self.robots.holonomic)

    @property
    def silent(self) -> bool:
        """Whether nothing is written now and nothing will be by itself."""
        return self.motion.silent and not self.testing

    @property
    def testing(self) -> bool:
        """Whether a stop test is going on."""
        return self.test is not None and self.test.running

    @property
    def active(self) -> bool:
        """Whether time alone may make a difference."""
        return (
            self.lease is not None
            or not self.silent
            or self.motion.owes_zero
            or self.standing.confirming
            or self.motion.held
            or self.handover.going_on
            or self.sight.on
        )

    # The robots that it is.

    def declare(
        self, spec: RobotSpec, tasks: Health, hooks: Health, now: float
    ) -> None:
        """Take in a robot, or what changed of it; a change ends the lease."""
        self.end_lease("the robot was declared anew", now)
        self.robots.declare(spec, tasks, hooks)

    def attached(self, now: float) -> None:
        """Note that the robot can be spoken to, as soon as there are links."""
        if self.latch.on:
            self._say_stop(now)

    def forget(self, robot: str, now: float) -> None:
        """Drop a robot; the last one stays until its machine has stopped."""
        self.robots.leaving.add(robot)
        if len(self.robots.specs) == len(self.robots.leaving):
            self.end_lease("the robot was removed", now)
        self._drop_leaving()

    def _drop_leaving(self) -> None:
        for robot in list(self.robots.leaving):
            if len(self.robots.specs) == 1:
                if not self.silent:
                    return
                self.sight.update(False)
            self.robots.drop(robot)

    # Whether it may move.

    def unarmable(self, now: float) -> str | None:
        """Return why nobody can take the machine now, in words."""
        heir = self.handover.heir
        if heir is not None and not self.latch.on:
            return f"it goes to {heir.name or heir.id} as soon as it stands"
        return self.arming.obstacle(now)

    def doubt(self, now: float) -> str | None:
        """Return why the machine must not be driven now, in words."""
        return self.arming.doubt(now) or self.video.doubt(now)

    # Leases.

    def is_held_by(self, connection: str) -> bool:
        """Return whether this connection has the lease."""
        return self.lease is not None and self.lease.connection == connection

    def give(self, to: Connection, now: float) -> int:
        """Let somebody have the machine; nothing moves by that."""
        epoch = self._epochs.next()
        self.lease = Lease(to.id, to.name, epoch, to.program)
        self.deadman = DeadMan(needs_neutral=not to.program)
        self._page_cap = to.cap
        self.ages.clear()
        self.video.forget()
        self._update_watch(now)
        return epoch

    def set_cap(self, cap: Cap) -> None:
        """Change what the page of the lease's holder asks for at most."""
        self._page_cap = cap

    def end_lease(self, why: str | None, now: float) -> None:
        """Take the machine out of everybody's hands; it stops if it is driven.

        Args:
            why: What its driver, and who wanted it, are told, if it is not the
                driver's own doing.
            now: The time.

        """
        disappointed = self.handover.end()
        if disappointed is not None:
            self.robots.refuse(disappointed.id, "ask", why or "it is gone")
        self._end_lease(why, now)

    def _end_lease(self, why: str | None, now: float) -> None:
        lease = self.lease
        if lease is None:
            return
        self._halt(why or "the driver let go of it", now)
        self.lease, self._page_cap = None, None
        self.deadman = DeadMan()
        self.ages.clear()
        self.video.forget()
        self._update_watch(now)
        if why is not None:
            self.robots.refuse(lease.connection, "lease", why)

    def release(self, connection: str, now: float) -> None:
        """Give the machine back, or ask for it no longer."""
        self.handover.withdraw(connection)
        if not self.is_held_by(connection):
            return
        if self.handover.asker is not None:
            self.hand_over(self.handover.asker, now)
        else:
            self._end_lease(None, now)

    def lost(self, connection: str, now: float) -> None:
        """A page is gone: what it drove stops."""
        self.release(connection, now)
        for goals in self.robots.goals.values():
            goals.lost(connection)

    def ask(self, who: Connection, now: float) -> None:
        """Ask the holder for the machine.

        Raises:
            Refusal: If it can be taken without asking, or not at all.

        """
        if reason := self.unarmable(now):
            raise Refusal(reason)
        if self.lease is None or self.lease.program:
            raise Refusal("no person has it: take it")
        self.handover.ask(who, now)

    def deny(self, why: str) -> None:
        """Have the holder keep it."""
        asker = self.handover.end()
        assert asker is not None  # only then is there anything to deny
        self.robots.refuse(asker.id, "ask", why)

    def hand_over(self, heir: Connection, now: float) -> None:
        """Zero first; ``heir`` gets the machine when it stands (S5)."""
        self._end_lease(f"{heir.name or heir.id} gets it", now)
        if self.robots.drivable:
            self.motion.zero(now)
        self.robots.make_way()  # what follows a goal does not come to stand
        self.handover.begin(heir, now)
        self._update_watch(now)

    def _change_hands(self, now: float) -> None:
        """Let time have its say about who gets the machine."""
        handover = self.handover
        if handover.asker is not None and handover.left(now) == 0:
            self.hand_over(handover.asker, now)
        heir = handover.heir
        if heir is None:
            return
        if reason := self.arming.obstacle(now):
            self.end_lease(reason, now)
        elif handover.stands(now):
            handover.end()
            self.give(heir, now)
        elif self.robots.drivable and not self.motion.stopping:
            self.motion.zero(now)

    # Motion.

    def drive(self, wanted: Twist, neutral: bool, tick: int, now: float) -> str | None:
        """Take in an accepted command of the lease's holder.

        Args:
            wanted: The velocity asked for, not yet limited.
            neutral: Whether every input is released.
            tick: The tick that it echoes.
            now: The time.

        Returns:
            Why nothing moves although something should, in words, or ``None``.

        """
        lease = self.lease
        assert lease is not None
        if reason := self.doubt(now):
            self._fault(reason, now)
            return None if neutral else reason
        self.deadman.accept(neutral, tick, now)
        if self.deadman.expired(now):
            self._lapse("the driver hears nothing", now)
            return None if neutral else "no new tick has come to the driver"
        if self.test is not None and self.test.running:
            return self._go_on_with_test(self.test, lease, neutral, now)
        if neutral or not self.deadman.armed:
            self.motion.halt(now)
            return None if neutral else "release every input first"
        self._drive(wanted, lease, now)
        return None

    def _drive(self, wanted: Twist, lease: Lease, now: float) -> None:
        if not self.motion.driving:
            self.robots.make_way()
        bounds = self._bounds()
        fitted = fit(wanted, bounds.speed, holonomic=bounds.holonomic)
        self.motion.drive(self.guard.limit(fitted, now), lease, now)

    def late(self, now: float) -> None:
        """A command of the lease's holder came too late: that is doubt, so zero (S1).

        Whatever it says, its way takes too long for anybody to drive by.
        """
        self._lapse("the driver's commands come too late", now)

    def begin_test(self, now: float) -> None:
        """Begin the stop test for the holder of the lease.

        Raises:
            Refusal: If the machine cannot be tested now.

        """
        if self.testing:
            raise Refusal("a stop test is going on")
        if reason := self.doubt(now):
            raise Refusal(reason)
        if not self.deadman.armed or not self.motion.silent:
            raise Refusal("release every input first")
        measured = self.sight.measured
        if measured is None:
            raise Refusal("without odometry nothing can be measured")
        if speed_of(measured) >= STILL_V:
            raise Refusal("it moves already")
        self.test = StopTest(now)

    def _go_on_with_test(
        self, test: StopTest, lease: Lease, neutral: bool, now: float
    ) -> str | None:
        if not neutral:
            self._lapse("a key was pressed", now)
            return "a stop test was going on: release every input first"
        if not self.deadman.armed:
            self._lapse("the driver fell silent", now)
        if test.state == "creeping":
            self._drive(CREEP, lease, now)
        return None

    def _after_test(self, test: StopTest, now: float) -> None:
        """Do what the stop test has come to."""
        if test.state == "waiting":
            self.motion.leave_alone()
        else:
            self.motion.zero(now)
            if test.concluded:
                self._emit(KeepStopTest(self.key, test.seconds))

    def _halt(self, why: str, now: float) -> None:
        """Go to zeros if it was driven or tested, for the reason in words."""
        if self.test is not None and self.test.running:
            self.test.abort(why)
            self.motion.zero(now)
        self.motion.halt(now)

    def goal(
        self, robot: str, pose: tuple[float, float, float], by: str, now: float
    ) -> None:
        """Send the machine somewhere by itself; that ends driving.

        Raises:
            Refusal: If it cannot be sent now.

        """
        if reason := self.unarmable(now):
            raise Refusal(reason)
        self._lapse("a goal was sent", now)
        self.robots.goals[robot].send(*pose, by)

    def locate(
        self, robot: str, pose: tuple[float, float, float], by: str, now: float
    ) -> None:
        """Tell the robot where it is, while nothing moves it.

        Raises:
            Refusal: If it cannot be told now.

        """
        if reason := self.unarmable(now):
            raise Refusal(reason)
        if not self.silent:
            raise Refusal("it is driven: let it stand first")
        self.robots.goals[robot].locate(*pose, by)

    def wrote_goal(self, write: WroteGoal) -> None:
        """Note that a goal went out: what moves from here on moves by itself."""
        self.robots.goals[write.robot].wrote(write)
        self.obedience.excuse()

    def stop(self, by: str, now: float) -> None:
        """STOP: zero at once, whoever drives it or nobody; no lease, no goals."""
        self.end_lease(f"STOP by {by}", now)
        self.standing.press(by, now)
        self._expect_standstill(now)

    def _say_stop(self, now: float) -> None:
        self.standing.say_all(now)
        self._expect_standstill(now)

    def _expect_standstill(self, now: float) -> None:
        self.obedience.expect(now)
        self._update_watch(now)

    def reset(self, now: float) -> None:
        """End the STOP that stands; nothing moves by that, and nobody has it.

        Raises:
            Refusal: If none stands.

        """
        self.standing.reset()
        self._update_watch(now)

    def step(self, now: float) -> None:
        """Let time have its say."""
        if self.lease is not None:
            if reason := self.doubt(now):
                self._fault(reason, now)
            elif self.deadman.expired(now):
                self._lapse("the driver fell silent", now)
        if self.test is not None and self.test.running:
            self.test.step(now)
            if not self.test.running:
                self._after_test(self.test, now)
        self.ages.forget_old(now)
        self._change_hands(now)
        self.motion.step(now)
        if self.standing.confirming:
            self.standing.confirm(now)
        self._update_watch(now)
        self._drop_leaving()

    def _lapse(self, why: str, now: float) -> None:
        self.deadman.disarm()
        self._halt(why, now)

    def _fault(self, reason: str, now: float) -> None:
        """Stop and disarm, because something may not be as it should."""
        driving = self.motion.driving
        self._lapse(reason, now)
        # A program is not seen to let go of anything, so it has to take it again.
        if driving and self.lease is not None and self.lease.program:
            self.end_lease(reason, now)

    # What is heard of it.

    def wrote(self, write: Wrote, now: float) -> None:
        """Note what became of a velocity."""
        if not write.done:
            return
        self.obedience.wrote(write.twist, self.motion.sent, now)
        self.motion.wrote(write, now)
        twist = write.twist
        for robot in self.robots.specs:
            sent = SentTwist(robot, twist.vx, twist.vy, twist.wz, write.by)
            self._emit(Say(sent))

    def saw(self, measured: Twist | None, now: float) -> None:
        """Note that odometry came."""
        if not self.sight.on:
            return
        self.sight.saw(measured, now)
        if self.standing.confirming:
            self.standing.confirmation.saw(measured, now)
        if self.handover.heir is not None:
            self.handover.saw(measured, now)
        self.obedience.saw(measured, now)
        test = self.test
        if test is not None and test.running:
            state = test.state
            test.saw(measured, self.motion.moved_at, now)
            if test.state != state:
                self._after_test(test, now)

    def saw_echo(self, twist: Twist) -> None:
        """Note what the robot's ROS says on the velocity topic."""
        if self.sight.on:
            self.sight.echoed = twist

    def locked(self, lock: LockState, now: float) -> None:
        """Note whether this gate alone has the machine."""
        self.arming.lock, self.known, self.tested = lock, True, lock.tested
        if lock.driven:
            self.motion.owe_from_before()
            self.link_up(now)
        if lock.held and lock.latched_by is not None and not self.latch.on:
            self.latch.found(lock.latched_by)
            self._say_stop(now)

    def latch_kept(self, event: LatchKept) -> None:
        """Note that the disk knows whether STOP stands."""
        self.latch.kept(event)

    def stop_tested(self, record: StopRecord) -> None:
        """Note what a stop test found, and the day of it."""
        self.tested = record

    def link_up(self, now: float) -> None:
        """A zero that may not have arrived goes first."""
        if not self.control.up:
            return
        self.motion.pay(now)
        if self.latch.on:
            self._say_stop(now)

    def tasks_up(self, link: Health) -> None:
        """Say what could not be said for want of this link."""
        self.standing.tasks_up(link)

    def link_down(self, now: float) -> None:
        """The control link is gone."""
        if self.lease is not None:
            self._fault(f"no link to {self.key.url}", now)

    def _update_watch(self, now: float) -> None:
        self.sight.update(
            self.lease is not None
            or not self.silent
            or self.standing.confirming
            or self.handover.heir is not None
            or (self.robots.has_odometry and self.obedience.watching(now))
        )
        if not self.sight.on:
            self.guard.forget()
