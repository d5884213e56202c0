"""Commands of a program to the gate: its own lease, velocities, goals and poses."""

import concurrent.futures
import itertools
import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from webmap.base.errors import MotionError, NoLease
from webmap.base.geometry import Twist
from webmap.gate import commands, protocol
from webmap.gate.protocol import PROGRAM, FromProgram

AGAIN = 0.5
"""Seconds without an answer after which a request is sent again: a network may lose it
on the way to the gate of an agent, or the answer."""

PATIENCE = 3.0
"""Seconds without an answer after which a request is given up."""

LEAST_PAUSE = 0.01
"""The least time between two velocities for one robot, in seconds. A program that sends
velocities without a pause would delay every robot's STOP."""


Taken = concurrent.futures.Future[int]
"""The epoch of a lease to come."""


@dataclass
class PendingRequest:
    """A request to take or release a robot, which the gate has not answered yet."""

    robot: str
    message: FromProgram
    began: float
    sent_at: float


class ProgramCommands:
    """The commands that Python code in the display may send to the gate.

    Args:
        send: Sends a message to the gate, if it runs.
        lock: Held while the state changes.
        clock: Returns the time, in seconds.
        connection: The name of this program at the gate.

    """

    def __init__(
        self,
        send: Callable[[protocol.ToGate], None],
        lock: "threading.RLock",
        clock: Callable[[], float] = time.monotonic,
        connection: str = PROGRAM,
    ) -> None:
        self.connection = connection
        self._send = send
        self._lock = lock
        self._clock = clock
        self._numbers = itertools.count(1)
        self._takes: dict[int, tuple[PendingRequest, Taken]] = {}
        """By the number of the request."""
        self._releases: dict[str, PendingRequest] = {}
        """By robot."""
        self._epochs: dict[str, int] = {}
        self._passed_on: dict[str, tuple[float, commands.Velocity]] = {}
        """By robot, the last velocity sent to the gate, and its time."""
        self._tick: int | None = None

    def take(self, robot_id: str, trouble: str | None) -> Taken:
        """Take the lease of a robot.

        Args:
            robot_id: The robot.
            trouble: Why there is no gate; ``None`` if one runs.

        Returns:
            A future of the lease's epoch; its exception is ``NoLease`` if the gate
            refuses or does not answer.

        """
        future: Taken = concurrent.futures.Future()
        future.set_running_or_notify_cancel()
        with self._lock:
            if trouble is not None:
                future.set_exception(NoLease(trouble))
                return future
            self._releases.pop(robot_id, None)
            number = next(self._numbers)
            take = FromProgram(commands.Take(robot_id), number)
            self._takes[number] = self._request(robot_id, take), future
        return future

    def release(self, robot_id: str) -> None:
        """Release the program's lease; the robot is stopped if it is driven."""
        self._release(robot_id, "control was released")

    def _release(self, robot: str, why: str) -> None:
        with self._lock:
            self._epochs.pop(robot, None)
            given_up = [
                number
                for number, (take, _) in self._takes.items()
                if take.robot == robot
            ]
            ended = [self._takes.pop(number)[1] for number in given_up]
            release = FromProgram(commands.Release(robot))
            self._releases[robot] = self._request(robot, release)
        for taken in ended:
            taken.set_exception(NoLease(f"robot {robot!r}: {why}"))

    def _request(self, robot: str, message: FromProgram) -> PendingRequest:
        now = self._clock()
        self._send(message)
        return PendingRequest(robot, message, now, now)

    def twist(self, robot_id: str, twist: Twist) -> None:
        """Send one velocity; without another within 200 ms the robot is stopped.

        A velocity less than 10 ms after the last one sent is left out, unless it is a
        zero after motion.

        Raises:
            NoLease: If this program does not hold the lease.
            MotionError: If the velocity has a number that is not finite.

        """
        if not twist.is_finite:
            raise MotionError(f"expected a velocity of finite numbers, got {twist}")
        with self._lock:
            epoch, tick = self._licence(robot_id)
            x, y, turn, z, rx, ry = map(float, twist.numbers)
            velocity = (x, y, turn, z, rx, ry)
            now = self._clock()
            at, last = self._passed_on.get(robot_id, (-math.inf, velocity))
            if now - at < LEAST_PAUSE and (any(velocity) or not any(last)):
                return
            self._passed_on[robot_id] = (now, velocity)
            command = commands.SetVelocity(robot_id, epoch, tick, velocity)
            self._send(FromProgram(command))

    def move(self, robot_id: str, x: float, y: float, yaw: float) -> None:
        """Send a goal: metres and radians in the robot's ``goal_frame``.

        Raises:
            NoLease: If this program does not hold the lease.
            MotionError: If the pose has a number that is not finite.

        """
        pose = _finite(x, y, yaw)
        with self._lock:
            epoch, tick = self._licence(robot_id)
            self._send(FromProgram(commands.Goal(robot_id, epoch, 0, tick, *pose)))

    def locate(self, robot_id: str, x: float, y: float, yaw: float) -> None:
        """State where a robot is: metres and radians in its ``goal_frame``.

        Raises:
            NoLease: If this program does not hold the lease.
            MotionError: If the pose has a number that is not finite.

        """
        pose = _finite(x, y, yaw)
        with self._lock:
            epoch, tick = self._licence(robot_id)
            self._send(FromProgram(commands.Locate(robot_id, epoch, 0, tick, *pose)))

    def cancel(self, robot_id: str) -> None:
        """Cancel the robot's goals; needs no lease."""
        self._send(FromProgram(commands.Cancel(robot_id)))

    def _licence(self, robot_id: str) -> tuple[int, int]:
        epoch = self._epochs.get(robot_id)
        if epoch is None or self._tick is None:
            raise NoLease(f"this program does not have control of robot {robot_id!r}")
        return epoch, self._tick

    # Messages from the gate.

    def on_tick(self, tick: int) -> None:
        """Note the newest tick, and send requests without an answer again."""
        self._tick = tick
        if not self._takes and not self._releases:
            return
        with self._lock:
            now = self._clock()
            takes = [take for take, _ in self._takes.values()]
            for each in [*takes, *self._releases.values()]:
                if now - each.sent_at > AGAIN:
                    each.sent_at = now
                    self._send(each.message)
            late = {each.robot for each in takes if now - each.began > PATIENCE}
            for robot, release in list(self._releases.items()):
                if now - release.began > PATIENCE:
                    del self._releases[robot]
        for robot in late:
            self._release(robot, "no answer of the gate")  # it may have been given

    def on_report(self, report: protocol.RobotReport) -> None:
        """Note whether this program holds a robot's lease now."""
        holder = None if report.holder is None else report.holder.connection
        with self._lock:
            if holder != self.connection or report.epoch is None:
                self._epochs.pop(report.robot, None)
                self._passed_on.pop(report.robot, None)
                self._releases.pop(report.robot, None)
            elif report.robot not in self._releases:
                self._epochs[report.robot] = report.epoch

    def on_take_reply(self, reply: protocol.TakeReply) -> None:
        """Set the result of a :meth:`take` of this program."""
        if reply.connection != self.connection:
            return
        with self._lock:
            answered = self._takes.pop(reply.request, None)
            if answered is None:
                return
            if reply.epoch is not None:
                self._epochs[reply.robot] = reply.epoch
        _, taken = answered
        if reply.epoch is None:
            taken.set_exception(NoLease(f"robot {reply.robot!r}: {reply.why}"))
        else:
            taken.set_result(reply.epoch)

    def gone(self, why: str) -> None:
        """Note that the gate has ended, and every lease with it."""
        with self._lock:
            takes, self._takes = self._takes, {}
            self._releases.clear()
            self._tick = None
            self._epochs.clear()
        for _, taken in takes.values():
            taken.set_exception(NoLease(why))


def _finite(x: float, y: float, yaw: float) -> tuple[float, float, float]:
    if not all(map(math.isfinite, (x, y, yaw))):
        raise MotionError(f"expected a pose of finite numbers, got {(x, y, yaw)}")
    return float(x), float(y), float(yaw)
