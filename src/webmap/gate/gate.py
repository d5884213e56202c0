"""The gate's decisions: events in, actions out. No I/O and no clock of its own.

The shell calls :meth:`Gate.handle` for whatever happens and :meth:`Gate.step` every
10 ms, and does what they return, in that order. What came of a write it tells with a
further event before it does anything else.
"""

import logging
import math
from collections.abc import Callable
from typing import Any

from webmap.gate import events, messages
from webmap.gate.actions import Action, Say
from webmap.gate.base import Base
from webmap.gate.commands import (
    Ask,
    Command,
    Deny,
    Drive,
    Goal,
    Grant,
    Locate,
    Release,
    Reset,
    Stop,
    StopTest,
    Take,
    op_of,
    parse,
)
from webmap.gate.connection import Connection
from webmap.gate.fleet import Fleet
from webmap.gate.health import Pulse
from webmap.gate.lease import Epochs, check_lease, check_role, check_take
from webmap.gate.messages import PROGRAM
from webmap.gate.people import People
from webmap.gate.refusal import Refusal
from webmap.gate.ticks import Ticks
from webmap.geometry import Twist

log = logging.getLogger("webmap.gate")

SETTLE = 1.5
"""Seconds for which a program waits at most until a robot that it took would move."""


class Gate:
    """Decides over every machine of one display.

    Args:
        ticks: The ticks to issue.
        epochs: The epochs to give to leases.

    """

    def __init__(
        self, ticks: Ticks | None = None, epochs: Epochs | None = None
    ) -> None:
        self._ticks = ticks or Ticks()
        self._out: list[Action] = []
        self._pulse = Pulse()
        self._people = People(self._out.append)
        self._fleet = Fleet(
            self._pulse, epochs or Epochs(), self._out.append, self._people.refuse
        )
        self._display_there = False
        self._takes: list[tuple[messages.ProgramTake, int, float]] = []
        self._handlers: dict[type, Callable[[Any, float], None]] = {
            **self._fleet.handlers,
            messages.Connect: self._connect,
            messages.Disconnect: self._disconnect,
            messages.FromBrowser: self._from_browser,
            messages.Speeds: self._speeds,
            messages.Heartbeat: self._beat,
            messages.Stop: self._program_stop,
            messages.Reset: self._program_reset,
            messages.ProgramTake: self._program_take,
            messages.ProgramRelease: self._program_release,
            messages.ProgramTwist: self._program_twist,
            messages.ProgramMove: self._program_move,
            messages.ProgramLocate: self._program_locate,
            messages.ProgramCancel: self._program_cancel,
            events.Shutdown: self._shut_down,
        }

    def handle(self, event: messages.ToGate | events.Event, now: float) -> list[Action]:
        """Take in one event and return what is to be done, in order."""
        self._handlers[type(event)](event, now)
        return self._actions(now)

    def step(self, now: float) -> list[Action]:
        """Let time pass and return what is to be done, in order."""
        if self._display_there and self._pulse.doubt(now):
            self._display_there = False
            self._goals_lost()
        self._fleet.step(now)
        self._answer_takes(now)
        self._people.count(now)
        tick = self._ticks.issue(now)
        if tick is not None:
            self._out.append(Say(messages.Tick(tick, self._people.acks)))
        return self._actions(now)

    @property
    def busy(self) -> bool:
        """Whether time may make a difference to some machine."""
        return self._fleet.busy

    @property
    def silent(self) -> bool:
        """Whether no machine is driven or being stopped."""
        return self._fleet.silent

    def _actions(self, now: float) -> list[Action]:
        self._fleet.report(now)
        actions = self._out.copy()
        self._out.clear()
        return actions

    # The display and its pages.

    def _beat(self, message: messages.Heartbeat, now: float) -> None:
        self._display_there = True
        self._pulse.beat(now)

    def _shut_down(self, event: events.Shutdown, now: float) -> None:
        self._pulse.ended = event.why
        for base in self._fleet:
            base.end_lease(event.why, now)
        self._goals_lost()

    def _goals_lost(self) -> None:
        """Nobody is left who could look after a goal."""
        for base in self._fleet:
            for goals in base.robots.goals.values():
                goals.lost()

    def _connect(self, message: messages.Connect, now: float) -> None:
        if message.connection != PROGRAM:
            self._disconnect(messages.Disconnect(message.connection), now)
            self._people.add(message)

    def _disconnect(self, message: messages.Disconnect, now: float) -> None:
        if message.connection == PROGRAM or not self._people.remove(message.connection):
            return
        for base in self._fleet:
            base.lost(message.connection, now)

    def _speeds(self, message: messages.Speeds, now: float) -> None:
        connection = self._people.find(message.connection)
        if connection is None:
            return
        connection.set_speeds(message.v, message.w)
        for base in self._fleet:
            if base.is_held_by(connection.id):
                base.set_cap(connection.cap)

    def _from_browser(self, message: messages.FromBrowser, now: float) -> None:
        connection = self._people.find(message.connection)
        if connection is None or connection.program:
            return
        try:
            command = parse(message.text)
        except Refusal as refusal:
            self._people.refuse(connection.id, None, "command", refusal.why, now)
            if connection.garbage.too_often(now):
                self._people.close(connection, "too many messages that make no sense")
        else:
            what = op_of(command)
            self._attempt(
                connection,
                command.robot,
                what,
                lambda: self._obey(connection, command, now),
                now,
            )
        if connection.messages.too_often(now):
            self._people.close(connection, "too many messages")

    def _attempt(
        self,
        connection: Connection,
        robot: str | None,
        what: str,
        act: Callable[[], object],
        now: float,
    ) -> None:
        try:
            act()
        except Refusal as refusal:
            self._people.refuse(connection.id, robot, what, refusal.why, now)

    # Commands.

    def _obey(self, connection: Connection, command: Command, now: float) -> None:
        match command:
            case Stop(robot):
                # Before any check: a stop is always allowed.
                self._stop(robot, connection, now)
            case Reset(robot):
                self._reset(robot, connection, now)
            case Drive():
                self._drive(connection, command, now)
            case Goal(robot):
                base, _ = self._licensed(connection, command, now)
                pose = (command.x, command.y, command.yaw)
                base.goal(robot, pose, connection.id, now)
            case Locate(robot):
                base, _ = self._licensed(connection, command, now)
                pose = (command.x, command.y, command.yaw)
                base.locate(robot, pose, connection.id, now)
            case Take(robot):
                self._take(connection, robot, now)
            case Release(robot):
                self._release(connection, robot, now)
            case Ask(robot):
                self._ask(connection, robot, now)
            case Grant() | Deny():
                self._answer(connection, command, now)
            case StopTest(robot):
                base = self._fleet.find(robot)
                if not base.is_held_by(connection.id):
                    raise Refusal("take it first")
                base.begin_test(now)
            case _:
                self._cancel(connection, command.robot)

    def _cancel(self, connection: Connection, robot: str) -> None:
        check_role(connection.role)
        self._fleet.find(robot).robots.goals[robot].cancel()

    def _stop(self, robot: str | None, by: Connection, now: float) -> None:
        for base in self._fleet if robot is None else [self._fleet.find(robot)]:
            base.stop(by.name or by.id, now)

    def _reset(self, robot: str | None, by: Connection, now: float) -> None:
        check_role(by.role)
        if robot is not None:
            self._fleet.find(robot).reset(now)
            return
        for base in self._fleet:
            if base.latch.on:
                base.reset(now)

    def _take(self, connection: Connection, robot: str, now: float) -> int | None:
        """Give somebody the lease; ``None`` if it comes when the machine stands."""
        base = self._fleet.find(robot)
        if base.is_held_by(connection.id):
            return base.lease.epoch  # type: ignore[union-attr]
        if base.handover.heir is connection:
            return None
        check_take(base.lease, connection.role, connection.program)
        if reason := base.unarmable(now):
            raise Refusal(reason)
        if base.lease is not None:
            base.hand_over(connection, now)
            return None
        return base.give(connection, now)

    def _release(self, connection: Connection, robot: str, now: float) -> None:
        self._fleet.find(robot).release(connection.id, now)

    def _ask(self, connection: Connection, robot: str, now: float) -> None:
        check_role(connection.role)
        base = self._fleet.find(robot)
        if base.is_held_by(connection.id):
            raise Refusal("you have it already")
        base.ask(connection, now)

    def _answer(self, connection: Connection, answer: Grant | Deny, now: float) -> None:
        base = self._fleet.find(answer.robot)
        if not base.is_held_by(connection.id):
            raise Refusal("only who has it can answer")
        asker = base.handover.asker
        if asker is None:
            raise Refusal("nobody asks for it")
        if isinstance(answer, Grant):
            base.hand_over(asker, now)
        else:
            base.deny(f"{connection.name or connection.id} keeps it")

    def _checked(
        self, connection: Connection, robot: str, epoch: int, tick: int, now: float
    ) -> tuple[Base, float]:
        """Return the machine if this connection may move it by this command.

        Besides it, the age of the command's loop in seconds.
        """
        base = self._fleet.find(robot)
        check_lease(base.lease, connection.id, epoch)
        try:
            return base, self._ticks.check(tick, now)
        except Refusal:
            base.late(now)  # after the lease was checked: no stranger's word stops it
            raise

    def _licensed(
        self, connection: Connection, command: Drive | Goal | Locate, now: float
    ) -> tuple[Base, float]:
        base, age = self._checked(
            connection, command.robot, command.epoch, command.tick, now
        )
        if command.seq <= connection.acked:
            raise Refusal("its seq is not larger than the one before")
        connection.acked = command.seq
        return base, age

    def _drive(self, connection: Connection, drive: Drive, now: float) -> None:
        base, age = self._licensed(connection, drive, now)
        base.ages.add(age, now)
        if drive.clamped and not connection.flagged:
            connection.flagged = True
            log.warning("connection %s asks for more than full speed", connection.id)
        # What the page showed when it spoke has aged on the way here.
        seen = None if drive.video is None else drive.video + age
        base.video.saw(seen, now)
        speed = base.speed
        wanted = Twist(drive.x * speed.v, drive.y * speed.v, drive.turn * speed.w)
        if reason := base.drive(wanted, drive.neutral, drive.tick, now):
            raise Refusal(reason)

    # The program's road.

    def _program_stop(self, message: messages.Stop, now: float) -> None:
        program, robot = self._people.program, message.robot
        self._attempt(
            program, robot, "stop", lambda: self._stop(robot, program, now), now
        )

    def _program_reset(self, message: messages.Reset, now: float) -> None:
        program, robot = self._people.program, message.robot
        self._attempt(
            program, robot, "reset", lambda: self._reset(robot, program, now), now
        )

    def _program_take(self, message: messages.ProgramTake, now: float) -> None:
        try:
            epoch = self._take(self._people.program, message.robot, now)
        except Refusal as refusal:
            self._reply(message, None, refusal.why)
        else:
            assert epoch is not None  # a program never waits for another to let go
            self._takes.append((message, epoch, now + SETTLE))
            self._answer_takes(now)

    def _answer_takes(self, now: float) -> None:
        """Answer the program once its robot would move, not before.

        A page waits for its hands to be seen; a program that drives at once would
        lose its first words to a link that has not been asked yet whether it lives.
        """
        waiting, self._takes = self._takes, []
        for take, epoch, until in waiting:
            try:
                base = self._fleet.find(take.robot)
                check_lease(base.lease, PROGRAM, epoch)
            except Refusal as refusal:
                self._reply(take, None, refusal.why)
                continue
            if now < until and base.robots.drivable and base.doubt(now):
                self._takes.append((take, epoch, until))
            else:
                self._reply(take, epoch, None)

    def _reply(
        self, take: messages.ProgramTake, epoch: int | None, why: str | None
    ) -> None:
        self._out.append(Say(messages.TakeReply(take.request, take.robot, epoch, why)))

    def _program_release(self, message: messages.ProgramRelease, now: float) -> None:
        program, robot = self._people.program, message.robot
        self._attempt(
            program, robot, "release", lambda: self._release(program, robot, now), now
        )

    def _program_twist(self, message: messages.ProgramTwist, now: float) -> None:
        program, robot = self._people.program, message.robot

        def drive() -> None:
            base, age = self._checked(program, robot, message.epoch, message.tick, now)
            base.ages.add(age, now)
            twist = Twist(*_finite(message.velocity))
            if reason := base.drive(twist, twist.is_zero, message.tick, now):
                raise Refusal(reason)

        self._attempt(program, robot, "drive", drive, now)

    def _program_move(self, message: messages.ProgramMove, now: float) -> None:
        program, robot = self._people.program, message.robot

        def move() -> None:
            base, _ = self._checked(program, robot, message.epoch, message.tick, now)
            base.goal(robot, _finite(message.pose), program.id, now)

        self._attempt(program, robot, "goal", move, now)

    def _program_locate(self, message: messages.ProgramLocate, now: float) -> None:
        program, robot = self._people.program, message.robot

        def locate() -> None:
            base, _ = self._checked(program, robot, message.epoch, message.tick, now)
            base.locate(robot, _finite(message.pose), program.id, now)

        self._attempt(program, robot, "locate", locate, now)

    def _program_cancel(self, message: messages.ProgramCancel, now: float) -> None:
        program, robot = self._people.program, message.robot
        self._attempt(
            program, robot, "cancel", lambda: self._cancel(program, robot), now
        )


def _finite(numbers: messages.Velocity) -> messages.Velocity:
    if not all(map(math.isfinite, numbers)):
        raise Refusal(f"expected finite numbers, got {numbers}")
    return numbers
