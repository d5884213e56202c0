"""The display's end of the gate: what pages and programs use.

A gate may end in the moment in which somebody says STOP, or not run at all. So a STOP
is kept until a gate that was told of it has gone on for a while, and every new gate is
told of it again. A robot that is told to stop twice stands no less.

Every method may be called from any thread and none waits for the gate. Callbacks come
in a thread of the client's own and must be quick.
"""

import concurrent.futures
import itertools
import json
import logging
import threading
import time
from collections.abc import Callable, Iterator

from webmap.base.errors import ConfigError
from webmap.base.geometry import Twist
from webmap.base.scope import Removal
from webmap.gate import commands, pipe, protocol
from webmap.gate.commands import Refusal, begins_like_stop, robot_in
from webmap.gate.display.pages import DriveConnection, Pages
from webmap.gate.display.program import ProgramCommands
from webmap.gate.display.supervisor import Supervisor
from webmap.gate.protocol import FromGate, FromProgram, Report, RobotSpec, Role
from webmap.gate.specs import checked

HEEDED = 2.0
"""Seconds for which a gate must have gone on since it was told."""


class PendingStops:
    """The STOPs that are kept, each with who said it."""

    def __init__(self) -> None:
        self._said: dict[tuple[str | None, str | None], float] = {}

    def __iter__(self) -> Iterator[tuple[str | None, str | None]]:
        """Go through them: by whose connection, or ``None``, and for which robot."""
        return iter(list(self._said))

    def say(self, by: str | None, robot: str | None, now: float) -> None:
        """Keep one; a gate that runs is told of it now.

        Args:
            by: The connection that said it; ``None`` for a program.
            robot: Which robot; ``None`` for all.
            now: The time.

        """
        self._said[by, robot] = now

    def told(self, now: float) -> None:
        """Note that a gate has only now been told of all."""
        self._said = dict.fromkeys(self._said, now)

    def lives(self, now: float) -> None:
        """Note that the gate that was told goes on."""
        if self._said:
            self._said = {
                who: at for who, at in self._said.items() if now - at < HEEDED
            }


__all__ = ["DriveConnection", "GateClient"]

log = logging.getLogger("webmap.gate")


class GateClient:
    """Starts the gate and talks to it, and starts it again if it ends.

    Robots that were declared, and connections, are told to every new gate; leases are
    not: they have ended with the old one.
    """

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._supervisor = Supervisor(self, self._lock)
        self._pages = Pages(self.send, self._lock, self._keep_stop_of_page)
        self._program = ProgramCommands(self.send, self._lock)
        self._pending_stops = PendingStops()
        self._numbers = itertools.count(1)
        self._specs: dict[str, RobotSpec] = {}
        self._listeners: dict[int, Callable[[Report], None]] = {}

    # Life.

    def start(self) -> None:
        """Start the gate and keep it running; the second call does nothing."""
        self._supervisor.start()

    def stop(self) -> None:
        """Have every driven robot stopped and the gate ended; returns after that."""
        self._supervisor.stop()

    @property
    def pid(self) -> int | None:
        """The number of the gate's process, if it runs."""
        return self._supervisor.pid

    @property
    def ready(self) -> bool:
        """Whether the gate runs and hears."""
        return self._supervisor.ready

    # Robots and pages.

    def declare(self, spec: RobotSpec) -> None:
        """Tell the gate of a robot, or what changed of it.

        Raises:
            ConfigError: If something in ``spec`` cannot be meant.

        """
        spec = checked(spec)
        try:
            pipe.pack(spec)
        except TypeError as error:  # a gate that is started anew would not hear it
            raise ConfigError(f"robot {spec.name!r}: {error}") from error
        with self._lock:
            self._specs[spec.id] = spec
            self.send(spec)

    def forget(self, robot_id: str) -> None:
        """Have the gate drop a robot; it is stopped if it is driven."""
        with self._lock:
            if self._specs.pop(robot_id, None) is not None:
                self.send(protocol.Forget(robot_id))

    def connect(
        self,
        name: str,
        role: Role,
        send: Callable[[str], None],
        close: Callable[[str], None],
    ) -> DriveConnection:
        """Introduce a page's socket to the gate.

        Args:
            name: Who that is, for people.
            role: What they may do.
            send: Takes each text for the page, in the client's thread.
            close: Takes the reason why the socket should be closed, likewise.

        Raises:
            ConfigError: If there is no such role.

        """
        return self._pages.connect(name, role, send, close)

    def on_report(self, fn: Callable[[Report], None]) -> Removal:
        """Call ``fn`` with every report, in the client's thread."""
        number = next(self._numbers)
        with self._lock:
            self._listeners[number] = fn
        return Removal(lambda: self._listeners.pop(number, None))

    # The program's road.

    def take(self, robot_id: str) -> "concurrent.futures.Future[int]":
        """Ask for the lease of a robot, for this program.

        Returns:
            A future of the lease's epoch; its exception is ``NoLease`` if the robot
            is not to be had.

        """
        trouble = None
        if not self.ready:
            trouble = self._supervisor.trouble or "the gate is not running"
        return self._program.take(robot_id, trouble)

    def release(self, robot_id: str) -> None:
        """Give the program's lease back; the robot is stopped if it is driven."""
        self._program.release(robot_id)

    def twist(self, robot_id: str, twist: Twist) -> None:
        """Send one velocity; without another within 200 ms the robot is stopped.

        Raises:
            NoLease: If this program does not hold the lease.
            MotionError: If the velocity is not made of finite numbers.

        """
        self._program.twist(robot_id, twist)

    def move(self, robot_id: str, x: float, y: float, yaw: float) -> None:
        """Send a goal: metres and radians in the robot's ``goal_frame``.

        Raises:
            NoLease: If this program does not hold the lease.
            MotionError: If the pose is not made of finite numbers.

        """
        self._program.move(robot_id, x, y, yaw)

    def locate(self, robot_id: str, x: float, y: float, yaw: float) -> None:
        """Tell where a robot is: metres and radians in its ``goal_frame``.

        Raises:
            NoLease: If this program does not hold the lease.
            MotionError: If the pose is not made of finite numbers.

        """
        self._program.locate(robot_id, x, y, yaw)

    def cancel(self, robot_id: str) -> None:
        """Cancel the robot's goals; needs no lease."""
        self._program.cancel(robot_id)

    def stop_robot(self, robot_id: str | None) -> None:
        """STOP a robot or, with ``None``, all of them."""
        with self._lock:
            self._keep_stop(None, robot_id)
            self.send(FromProgram(commands.Stop(robot_id)))

    def reset(self, robot_id: str, stop: str) -> None:
        """End the STOP of a robot that has this identity; moves nothing.

        Args:
            robot_id: The robot.
            stop: The identity, as the robot's report tells it. The gate refuses the
                reset if a newer STOP stands.

        """
        if self.ready:
            self.send(FromProgram(commands.Reset(robot_id, stop)))
        else:
            log.error("the gate is not running: the reset is lost")

    def name_writers(self, robot_id: str, nodes: tuple[str, ...]) -> None:
        """Tell which nodes besides the bridge publish to a robot's velocity topic."""
        self.send(protocol.WriterNodes(robot_id, nodes))

    def send(self, message: protocol.ToGate) -> None:
        """Send a message to the gate, if it runs."""
        self._supervisor.send(message)

    # STOPs that may not have been heard.

    def _keep_stop_of_page(self, message: protocol.FromPage) -> None:
        """Keep a page's STOP, in case that no gate hears it."""
        if b"stop" not in message.text:
            return
        try:
            command = commands.parse(message.text)
        except Refusal:
            if not begins_like_stop(message.text):
                return
            robot = robot_in(message.text)
        else:
            if not isinstance(command, commands.Stop):
                return
            robot = command.robot
        # As the gate does: what names no robot that is known is for all.
        known = robot in self._specs
        self._keep_stop(message.connection, robot if known else None)

    def _keep_stop(self, by: str | None, robot: str | None) -> None:
        if not self.ready:
            log.error("STOP: the gate is not running; STOP is sent as soon as it runs")
        self._pending_stops.say(by, robot, time.monotonic())

    def _stop_again(self, by: str | None, robot: str | None) -> protocol.ToGate:
        if by is None or not self._pages.knows(by):
            return FromProgram(commands.Stop(robot))
        text = json.dumps({"op": "stop", "robot": robot or "*"})
        return protocol.FromPage(by, text.encode())

    # The gate.

    def introduction(self) -> list[protocol.ToGate]:
        """Return what a new gate must hear first."""
        stops = [
            self._stop_again(by, robot)
            for by, robot in self._pending_stops
            if robot is None or robot in self._specs  # or it is gone since
        ]
        return [*self._specs.values(), *self._pages.introduction, *stops]

    def hear(self, message: FromGate) -> None:
        """Take in what the gate says."""
        match message:
            case protocol.Tick(tick):
                self._program.on_tick(tick)
                self._pages.on_tick(message)
                with self._lock:
                    self._pending_stops.lives(time.monotonic())
            case protocol.RobotReport():
                self._program.on_report(message)
                self._pages.on_report(message)
                self._report(message)
            case protocol.Hello():
                self._pages.on_hello(message)
            case protocol.Refused():
                self._pages.on_refusal(message)
                self._report(message)
            case protocol.CloseConnection():
                self._pages.on_close(message)
            case protocol.TakeReply():
                self._program.on_take_reply(message)
            case protocol.RobotGone():
                self._pages.on_robot_gone(message)
                self._report(message)
            case protocol.Ready():
                with self._lock:
                    self._pending_stops.told(time.monotonic())
                self._report(protocol.GateUp())
            case _:  # for listeners alone
                self._report(message)

    def gone(self, down: protocol.GateDown) -> None:
        """Note that the gate is gone, and every lease with it."""
        self._pages.gone()
        self._program.gone(down.why)
        self._report(down)

    def _report(self, report: Report) -> None:
        for listener in list(self._listeners.values()):
            try:
                listener(report)
            except Exception:
                log.exception("a listener to the gate failed")
