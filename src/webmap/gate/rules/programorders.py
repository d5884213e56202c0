"""The road of the display's own Python code through the gate. No I/O."""

import math
from collections.abc import Callable
from typing import Any

from webmap.base.geometry import Twist
from webmap.gate import messages
from webmap.gate.actions import Emit, Say
from webmap.gate.messages import PROGRAM
from webmap.gate.refusal import Refusal
from webmap.gate.rules.fleet import Fleet
from webmap.gate.rules.lease import check_lease
from webmap.gate.rules.orders import Orders
from webmap.gate.rules.people import People

Vector = tuple[float, float, float]

SETTLE = 1.5
"""Seconds for which a program waits at most until a robot that it took would move."""


class ProgramOrders:
    """Takes what the program says.

    Args:
        fleet: The machines.
        people: Everybody who may say something, the program among them.
        orders: Does what is ordered.
        emit: Takes the actions.

    """

    def __init__(
        self, fleet: Fleet, people: People, orders: Orders, emit: Emit
    ) -> None:
        self._fleet = fleet
        self._people = people
        self._orders = orders
        self._emit = emit
        self._takes: list[tuple[messages.ProgramTake, int, float]] = []
        self.handlers: dict[type, Callable[[Any, float], None]] = {
            messages.Stop: self._stop,
            messages.Reset: self._reset,
            messages.ProgramTake: self._take,
            messages.ProgramRelease: self._release,
            messages.ProgramTwist: self._twist,
            messages.ProgramMove: self._move,
            messages.ProgramLocate: self._locate,
            messages.ProgramCancel: self._cancel,
        }

    def _stop(self, message: messages.Stop, now: float) -> None:
        program, robot = self._people.program, message.robot
        self._people.attempt(
            program.id,
            robot,
            "stop",
            lambda: self._orders.stop(robot, program, now),
            now,
        )

    def _reset(self, message: messages.Reset, now: float) -> None:
        program, robot = self._people.program, message.robot
        self._people.attempt(
            program.id,
            robot,
            "reset",
            lambda: self._orders.reset(robot, message.stop, program, now),
            now,
        )

    def _take(self, message: messages.ProgramTake, now: float) -> None:
        try:
            epoch = self._orders.take(self._people.program, message.robot, now)
        except Refusal as refusal:
            self._reply(message, None, refusal.why)
        else:
            assert epoch is not None  # a program never waits for another to let go
            self._takes.append((message, epoch, now + SETTLE))
            self.answer_takes(now)

    def answer_takes(self, now: float) -> None:
        """Answer the program once its robot would move, not before.

        A page waits for its hands to be seen; a program that drives at once would
        lose its first words to a link that has not been asked yet whether it lives.
        """
        waiting, self._takes = self._takes, []
        for take, epoch, until in waiting:
            try:
                base = self._fleet.find(take.robot)
                check_lease(base.hands.lease, PROGRAM, epoch)
            except Refusal as refusal:
                self._reply(take, None, refusal.why)
                continue
            if now < until and base.robots.drivable and base.arming.doubt(now):
                self._takes.append((take, epoch, until))
            else:
                self._reply(take, epoch, None)

    def _reply(
        self, take: messages.ProgramTake, epoch: int | None, why: str | None
    ) -> None:
        self._emit(Say(messages.TakeReply(take.request, take.robot, epoch, why)))

    def _release(self, message: messages.ProgramRelease, now: float) -> None:
        program, robot = self._people.program, message.robot
        self._people.attempt(
            program.id,
            robot,
            "release",
            lambda: self._orders.release(program, robot, now),
            now,
        )

    def _twist(self, message: messages.ProgramTwist, now: float) -> None:
        program, robot = self._people.program, message.robot

        def drive() -> None:
            base, age = self._orders.checked(
                program, robot, message.epoch, message.tick, now
            )
            base.speeds.ages.add(age, now)
            twist = Twist(*message.velocity)
            if not twist.is_finite:
                raise Refusal(f"expected finite numbers, got {message.velocity}")
            if reason := base.robots.axes.refusal(twist):
                raise Refusal(reason)
            if reason := base.driving.drive(twist, twist.is_zero, message.tick, now):
                raise Refusal(reason)

        self._people.attempt(program.id, robot, "drive", drive, now)

    def _move(self, message: messages.ProgramMove, now: float) -> None:
        program, robot = self._people.program, message.robot

        def move() -> None:
            base, _ = self._orders.checked(
                program, robot, message.epoch, message.tick, now
            )
            base.driving.goal(robot, _finite(message.pose), program.id, now)

        self._people.attempt(program.id, robot, "goal", move, now)

    def _locate(self, message: messages.ProgramLocate, now: float) -> None:
        program, robot = self._people.program, message.robot

        def locate() -> None:
            base, _ = self._orders.checked(
                program, robot, message.epoch, message.tick, now
            )
            base.driving.locate(robot, _finite(message.pose), program.id, now)

        self._people.attempt(program.id, robot, "locate", locate, now)

    def _cancel(self, message: messages.ProgramCancel, now: float) -> None:
        program, robot = self._people.program, message.robot
        self._people.attempt(
            program.id,
            robot,
            "cancel",
            lambda: self._orders.cancel(program, robot, now),
            now,
        )


def _finite(numbers: Vector) -> Vector:
    if not all(map(math.isfinite, numbers)):
        raise Refusal(f"expected finite numbers, got {numbers}")
    return numbers
