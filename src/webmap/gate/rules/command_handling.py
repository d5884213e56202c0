"""Executes the commands of pages and programs. No I/O."""

import logging
import math
from typing import NamedTuple

from webmap.base.geometry import Twist
from webmap.gate.actions import Emit, SendToDisplay
from webmap.gate.commands import (
    Ask,
    Check,
    Command,
    Deny,
    Drive,
    Goal,
    Grant,
    Locate,
    MoveFor,
    Refusal,
    Release,
    Renew,
    Reset,
    SetVelocity,
    Stop,
    StopTest,
    Take,
    op_of,
)
from webmap.gate.protocol import FromProgram, TakeReply
from webmap.gate.rules.connections import (
    Connection,
    Connections,
    Ticks,
    check_lease,
    check_role,
    check_take,
)
from webmap.gate.rules.machine import Machine
from webmap.gate.rules.machines import Machines
from webmap.gate.rules.stop import new_press

log = logging.getLogger("webmap.gate")

SETTLE = 1.5
"""Seconds for which a program waits at most until a robot that it took would move."""

MOST_WAITING = 20
"""Requests for one robot that may wait for one program."""


class WaitingTake(NamedTuple):
    """A program that waits until the robot that it took would move."""

    program: Connection
    request: int
    robot: str
    epoch: int
    until: float
    """When it waits no longer."""


class CommandHandler:
    """Executes a command completely, or refuses it.

    Args:
        machines: The machines.
        connections: Who may send commands; they receive refusals.
        ticks: The ticks that commands echo.
        emit: Called with each action.

    """

    def __init__(
        self, machines: Machines, connections: Connections, ticks: Ticks, emit: Emit
    ) -> None:
        self._machines = machines
        self._connections = connections
        self._ticks = ticks
        self._emit = emit
        self._takes: list[WaitingTake] = []

    def handle(self, connection: Connection, command: Command, now: float) -> None:
        """Execute the command of a page or of a program.

        Raises:
            Refusal: If the command is not executed.

        """
        match command:
            case Stop(robot):
                # No check comes first: STOP is always allowed.
                self.stop(robot, connection, now)
            case Reset(robot, stop):
                self.reset(robot, stop, connection, now)
            case Drive():
                self._drive(connection, command, now)
            case SetVelocity():
                self._set_velocity(connection, command, now)
            case Goal(robot):
                machine, _ = self._authorized(connection, command, now)
                machine.driving.goal(robot, _pose(command), connection.id, now)
            case MoveFor():
                self._move_for(command, now)
            case Locate(robot):
                machine, _ = self._authorized(connection, command, now)
                machine.driving.locate(robot, _pose(command), connection.id, now)
            case Take(robot):
                self.take(connection, robot, now)
            case Release(robot):
                self.release(connection, robot, now)
            case Renew(robot, epoch):
                authority = self._machines.find(robot).authority
                check_lease(authority.lease, connection.id, epoch)
                authority.renew(now)
            case Ask(robot):
                self._ask(connection, robot, now)
            case Grant() | Deny():
                self._answer(connection, command, now)
            case StopTest(robot):
                machine = self._machines.find(robot)
                if not machine.authority.is_held_by(connection.id):
                    raise Refusal("take control first")
                machine.driving.begin_test(now)
            case Check(robot):
                check_role(connection.role)
                machine = self._machines.find(robot)
                machine.check.passed(connection.name or connection.id, now)
            case _:
                self.cancel(connection, command.robot, now)

    def cancel(self, connection: Connection, robot: str, now: float) -> None:
        """Cancel a robot's goals; this needs no lease."""
        check_role(connection.role)
        goals = self._machines.find(robot).robots.goals[robot]
        goals.cancel(now, f"by {connection.called}")

    def stop(self, robot: str | None, by: Connection, now: float) -> None:
        """STOP a robot or, with ``None``, all robots: first the zeros of all."""
        press = new_press(by.name or by.id, by.identity)
        stopped = (
            list(self._machines) if robot is None else [self._machines.find(robot)]
        )
        for machine in stopped:
            if machine.robots.drivable:
                machine.motion.begin_zeros(now)
        for machine in stopped:
            machine.stop(press, now)

    def stop_malformed(self, robot: str | None, by: Connection, now: float) -> str:
        """STOP the robot that a malformed STOP names, or all if that is unknown.

        Args:
            robot: The robot's name, if the message has a readable one.
            by: The connection that sent the message.
            now: Seconds, monotonic.

        Returns:
            For what STOP is active, as text for people.

        """
        try:
            self._machines.check_known(robot)
        except Refusal:
            robot = None
        self.stop(robot, by, now)
        return f"STOP is active for {'all robots' if robot is None else repr(robot)}"

    def reset(self, robot: str, stop: str, by: Connection, now: float) -> None:
        """End the STOP with the identity ``stop`` of a robot."""
        check_role(by.role)
        self._machines.reset(robot, stop, by.id, now)

    def take(self, connection: Connection, robot: str, now: float) -> int | None:
        """Give the lease and return its epoch; ``None`` if a standstill comes first."""
        machine = self._machines.find(robot)
        if machine.authority.is_held_by(connection.id):
            return machine.authority.lease.epoch  # type: ignore[union-attr]
        if machine.authority.handover.successor is connection:
            return None
        check_take(machine.authority.lease, connection.role, connection.program)
        if reason := machine.authority.why_unavailable(now):
            raise Refusal(reason)
        if machine.authority.lease is not None:
            machine.authority.hand_over(connection, now)
            return None
        return machine.authority.give(connection, now)

    def release(self, connection: Connection, robot: str, now: float) -> None:
        """Release a connection's control of a robot."""
        self._machines.find(robot).authority.release(connection.id, now)

    def _ask(self, connection: Connection, robot: str, now: float) -> None:
        check_role(connection.role)
        machine = self._machines.find(robot)
        if machine.authority.is_held_by(connection.id):
            raise Refusal("you already have control")
        machine.authority.ask(connection, now)

    def _answer(self, connection: Connection, answer: Grant | Deny, now: float) -> None:
        machine = self._machines.find(answer.robot)
        if not machine.authority.is_held_by(connection.id):
            raise Refusal("only the operator who has control can answer")
        asker = machine.authority.handover.asker
        if asker is None:
            raise Refusal("no operator requests control")
        if isinstance(answer, Grant):
            machine.authority.hand_over(asker, now)
        else:
            machine.authority.deny(f"{connection.called} keeps control")
            machine.authority.renew(now)

    def checked(
        self, connection: Connection, robot: str, epoch: int, tick: int, now: float
    ) -> tuple[Machine, float]:
        """Return the machine and the age of the command's tick in seconds.

        Raises:
            Refusal: If the connection may not move the machine with this command.

        """
        machine = self._machines.find(robot)
        check_lease(machine.authority.lease, connection.id, epoch)
        try:
            return machine, self._ticks.check(tick, now)
        except Refusal:
            # Only the holder's commands stop the machine: the lease was checked first.
            machine.driving.late(now)
            raise

    def _authorized(
        self, connection: Connection, command: Drive | Goal | Locate, now: float
    ) -> tuple[Machine, float]:
        machine, age = self.checked(
            connection, command.robot, command.epoch, command.tick, now
        )
        if not connection.program:
            if command.seq <= connection.acked:
                raise Refusal("seq is not larger than the previous seq")
            connection.acked = command.seq
        return machine, age

    def _drive(self, connection: Connection, drive: Drive, now: float) -> None:
        machine, age = self._authorized(connection, drive, now)
        machine.speeds.ages.add(age, now)
        if drive.clamped and not connection.flagged:
            connection.flagged = True
            log.warning("connection %s asks for more than full speed", connection.id)
        # The picture of the page has aged since the page sent the command.
        seen = None if drive.video is None else drive.video + age
        machine.conditions.video.observe(seen, now)
        speed = machine.speeds.speed
        wanted = Twist(drive.x * speed.v, drive.y * speed.v, drive.turn * speed.w)
        if reason := machine.driving.drive(wanted, drive.neutral, drive.tick, now):
            raise Refusal(reason)

    def _move_for(self, command: MoveFor, now: float) -> None:
        """Send a goal in the name of a page, which keeps or gets control.

        A program takes control from nobody, and neither does it for a page.
        """
        page = self._connections.find(command.page)
        if page is None or page.program:
            raise Refusal("the page has closed")
        self._ticks.check(command.tick, now)
        machine = self._machines.find(command.robot)
        if not machine.authority.is_held_by(page.id):
            check_take(machine.authority.lease, page.role, program=True)
            self.take(page, command.robot, now)
        machine.driving.goal(command.robot, _pose(command), page.id, now)

    def _set_velocity(
        self, connection: Connection, command: SetVelocity, now: float
    ) -> None:
        machine, age = self.checked(
            connection, command.robot, command.epoch, command.tick, now
        )
        machine.speeds.ages.add(age, now)
        wanted = Twist(*command.velocity)
        if not wanted.is_finite:
            raise Refusal(f"expected finite numbers, got {command.velocity}")
        if reason := machine.robots.axes.refusal(wanted):
            raise Refusal(reason)
        if reason := machine.driving.drive(wanted, wanted.is_zero, command.tick, now):
            raise Refusal(reason)

    # Programs.

    def handle_program(self, message: FromProgram, now: float) -> None:
        """Execute a command of a program; a refusal is sent to the program."""
        program, command = self._connections.find(message.connection), message.command
        if program is None or not program.program:
            if not isinstance(command, Stop):
                return  # it is lost, and so is its control
            program = self._connections.program
        if isinstance(command, Take):
            self._take_for_program(program, message.request, command.robot, now)
            return
        self._connections.run_or_refuse(
            command.page if isinstance(command, MoveFor) else program.id,
            command.robot,
            op_of(command),
            lambda: self.handle(program, command, now),
            now,
        )

    def _take_for_program(
        self, program: Connection, request: int, robot: str, now: float
    ) -> None:
        try:
            if self._waiting(program, robot) >= MOST_WAITING:
                raise Refusal("this program waits for the robot already")
            epoch = self.take(program, robot, now)
        except Refusal as refusal:
            self._reply(program, request, robot, None, refusal.why)
        else:
            assert epoch is not None  # a program never waits for a handover
            self._takes.append(
                WaitingTake(program, request, robot, epoch, now + SETTLE)
            )
            self.reply_to_takes(now)

    def _waiting(self, program: Connection, robot: str) -> int:
        return sum(
            (each.program, each.robot) == (program, robot) for each in self._takes
        )

    def reply_to_takes(self, now: float) -> None:
        """Reply to a program when its robot can be driven, or after ``SETTLE``.

        A page waits until its inputs were seen released. A program that drives at once
        would lose its first commands to a link that has not answered a ping yet.
        """
        waiting, self._takes = self._takes, []
        for take in waiting:
            program, request, robot, epoch, until = take
            try:
                machine = self._machines.find(robot)
                check_lease(machine.authority.lease, program.id, epoch)
            except Refusal as refusal:
                self._reply(program, request, robot, None, refusal.why)
                continue
            if (
                now < until
                and machine.robots.drivable
                and machine.conditions.why_blocked(now)
            ):
                self._takes.append(take)
            else:
                self._reply(program, request, robot, epoch, None)

    def _reply(
        self,
        program: Connection,
        request: int,
        robot: str,
        epoch: int | None,
        why: str | None,
    ) -> None:
        reply = TakeReply(request, robot, epoch, why, program.id)
        self._emit(SendToDisplay(reply))


def _pose(command: Goal | MoveFor | Locate) -> tuple[float, float, float]:
    pose = (command.x, command.y, command.yaw)
    if not all(map(math.isfinite, pose)):
        raise Refusal(f"expected finite numbers, got {pose}")
    return pose
