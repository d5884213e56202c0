"""The display's client of the gate, which pages and programs use.

A gate may end just when a STOP is sent, or not run at all. So the client keeps each
STOP until a gate that received it has gone on for a while, and sends it to every new
gate again. A second STOP does no harm.

Every method may be called from any thread and none waits for the gate. Callbacks are
called in a thread of the client and must be quick.
"""

import concurrent.futures
import itertools
import json
import logging
import threading
import time
from collections.abc import Callable, Iterator
from typing import Literal

from webmap.base.errors import ConfigError
from webmap.base.geometry import Twist
from webmap.base.roles import Role
from webmap.base.scope import Removal
from webmap.gate import commands, pipe, protocol
from webmap.gate.commands import stop_in
from webmap.gate.display.pages import DriveConnection, Pages
from webmap.gate.display.program import ProgramCommands
from webmap.gate.display.supervisor import GateLink, GateListener, Supervisor
from webmap.gate.protocol import FromGate, FromProgram, Report, RobotSpec
from webmap.gate.specs import checked

CONFIRMED_AFTER = 2.0
"""Seconds for which a gate must go on after it received a STOP."""


class PendingStops:
    """The STOPs that are kept, each with its sender."""

    def __init__(self) -> None:
        self._sent: dict[tuple[str | None, str | None], float] = {}

    def __iter__(self) -> Iterator[tuple[str | None, str | None]]:
        """Yield the connection and the robot of each; see :meth:`add`."""
        return iter(list(self._sent))

    def add(self, by: str | None, robot: str | None, now: float) -> None:
        """Keep a STOP that is sent now to the gate, if it runs.

        Args:
            by: The connection that sent it; ``None`` for a program.
            robot: The robot; ``None`` for all.
            now: The time.

        """
        self._sent[by, robot] = now

    def on_gate_ready(self, now: float) -> None:
        """Note that a new gate has received all of them only now."""
        self._sent = dict.fromkeys(self._sent, now)

    def on_tick(self, now: float) -> None:
        """Note that the gate still runs: drop the STOPs that it has obeyed."""
        if self._sent:
            self._sent = {
                who: at for who, at in self._sent.items() if now - at < CONFIRMED_AFTER
            }


class TickTimes:
    """When the gate's ticks came; used in the client's thread, read in any."""

    WINDOW = 15.0
    """The longest time between two ticks is that of the last one or two windows."""

    def __init__(self) -> None:
        self._last: float | None = None
        self._begun = 0.0
        self._longest = (0.0, 0.0)

    def note(self, now: float) -> None:
        """Note a tick."""
        before, latest = self._longest
        if now - self._begun > self.WINDOW:
            self._begun, before, latest = now, latest, 0.0
        self._longest = (before, max(latest, self.age(now) or 0.0))
        self._last = now

    def end(self) -> None:
        """Note that the gate has ended."""
        self._last = None

    def age(self, now: float) -> float | None:
        """Return the seconds since the newest tick; None without a gate."""
        last = self._last
        return None if last is None else now - last

    def gap(self, now: float) -> float:
        """Return the longest time between two ticks lately, in seconds."""
        return max(*self._longest, self.age(now) or 0.0)


__all__ = ["DriveConnection", "GateClient", "TickTimes"]

log = logging.getLogger("webmap.gate")


class GateClient:
    """Starts the gate, exchanges messages with it, and restarts it if it ends.

    Every new gate receives the declared robots and the connections, but no leases: they
    ended with the old gate.

    Args:
        link: Makes the way to the gate, for its owner and with the lock to hold; a
            process of this computer by default.
        agent: The agent whose gate it is; "" for the display's own.
        prefix: What the ids of the pages and of the program begin with.

    """

    def __init__(
        self,
        link: "Callable[[GateListener, threading.RLock], GateLink]" = Supervisor,
        agent: str = "",
        prefix: str = "",
    ) -> None:
        self._lock = threading.RLock()
        self._supervisor = link(self, self._lock)
        self._pages = Pages(
            self.send, self._lock, self._heed, self._report, agent, prefix
        )
        self._program = ProgramCommands(
            self.send, self._lock, connection=f"{prefix}{protocol.PROGRAM}"
        )
        self._pending_stops = PendingStops()
        self.ticks = TickTimes()
        """When the gate's ticks came."""
        self._numbers = itertools.count(1)
        self._specs: dict[str, RobotSpec] = {}
        self._listeners: dict[int, Callable[[Report], None]] = {}

    # Start and end.

    def start(self) -> None:
        """Start the gate and keep it running; a second call does nothing."""
        self._supervisor.start()

    def stop(self) -> None:
        """Stop every driven robot and end the gate; return after that."""
        self._supervisor.stop()

    @property
    def pid(self) -> int | None:
        """The process id of the gate, if it runs."""
        return self._supervisor.pid

    @property
    def ready(self) -> bool:
        """Whether the gate runs and receives messages."""
        return self._supervisor.ready

    # Robots and pages.

    def declare(self, spec: RobotSpec) -> None:
        """Declare a robot to the gate, or a change of its declaration.

        Raises:
            ConfigError: If ``spec`` has an invalid value.

        """
        try:
            spec = checked(spec)
            pipe.pack(spec)
        except TypeError as error:  # otherwise no new gate could receive it
            raise ConfigError(f"robot {spec.name!r}: {error}") from error
        with self._lock:
            self._specs[spec.id] = spec
            self.send(spec)

    def forget(self, robot_id: str) -> None:
        """Remove a robot from the gate; it is stopped if it is driven."""
        with self._lock:
            if self._specs.pop(robot_id, None) is not None:
                self.send(protocol.Forget(robot_id))

    def connect(
        self,
        name: str,
        role: Role,
        send: Callable[[str], None],
        close: Callable[[str], None],
        id: str = "",
        identity: protocol.Identity | None = None,
        may_drive: Callable[[str], bool] | None = None,
    ) -> DriveConnection:
        """Register a page's socket with the gate.

        Args:
            name: The name of the page's user, for display.
            role: What the user may do.
            send: Called with each text for the page, in the client's thread.
            close: Called with the reason to close the socket, in the same thread.
            id: Its id at another gate, which the page knows.
            identity: That of the user and the page, if the page shows who "you" are.
            may_drive: Returns whether the user may command a robot; asked for each
                command, so that changes count at once. None for every robot.

        Raises:
            ConfigError: If there is no such role.

        """
        return self._pages.connect(name, role, send, close, id, identity, may_drive)

    def show_again(self, connection: DriveConnection) -> None:
        """Send a page the newest report of every robot."""
        self._pages.show_again(connection)

    def on_report(self, fn: Callable[[Report], None]) -> Removal:
        """Call ``fn`` with every report, in the client's thread."""
        number = next(self._numbers)
        with self._lock:
            self._listeners[number] = fn
        return Removal(lambda: self._listeners.pop(number, None))

    # For programs.

    def take(self, robot_id: str) -> "concurrent.futures.Future[int]":
        """Take the lease of a robot for this program.

        Returns:
            A future of the lease's epoch; its exception is ``NoLease`` if the gate
            refuses or does not answer.

        """
        trouble = None
        if not self.ready:
            trouble = self._supervisor.trouble or "the gate is not running"
        return self._program.take(robot_id, trouble)

    def release(self, robot_id: str) -> None:
        """Release the program's lease; the robot is stopped if it is driven."""
        self._program.release(robot_id)

    def twist(self, robot_id: str, twist: Twist) -> None:
        """Send one velocity; without another within 200 ms the robot is stopped.

        Raises:
            NoLease: If this program does not hold the lease.
            MotionError: If the velocity has a number that is not finite.

        """
        self._program.twist(robot_id, twist)

    def move(self, robot_id: str, x: float, y: float, yaw: float) -> None:
        """Send a goal: metres and radians in the robot's ``goal_frame``.

        Raises:
            NoLease: If this program does not hold the lease.
            MotionError: If the pose has a number that is not finite.

        """
        self._program.move(robot_id, x, y, yaw)

    def locate(self, robot_id: str, x: float, y: float, yaw: float) -> None:
        """State where a robot is: metres and radians in its ``goal_frame``.

        Raises:
            NoLease: If this program does not hold the lease.
            MotionError: If the pose has a number that is not finite.

        """
        self._program.locate(robot_id, x, y, yaw)

    def cancel(self, robot_id: str) -> None:
        """Cancel the robot's goals; needs no lease."""
        self._program.cancel(robot_id)

    def stop_robot(self, robot_id: str | None) -> None:
        """Send STOP to a robot or, with ``None``, to all."""
        with self._lock:
            self._keep_stop(None, robot_id)
            self.send(FromProgram(commands.Stop(robot_id)))

    def reset(self, robot_id: str, stop: str) -> None:
        """End the STOP with this identity; this moves nothing.

        Args:
            robot_id: The robot.
            stop: The identity, from the robot's report. The gate refuses the reset if a
                newer STOP is active.

        """
        if self.ready:
            self.send(FromProgram(commands.Reset(robot_id, stop)))
        else:
            log.error("the gate is not running: the reset is lost")

    def name_writers(self, robot_id: str, nodes: tuple[str, ...]) -> None:
        """Name the other nodes, not the bridge, that publish a robot's velocity."""
        self.send(protocol.WriterNodes(robot_id, nodes))

    def send(self, message: protocol.ToGate) -> None:
        """Send a message to the gate, if it runs."""
        self._supervisor.send(message)

    # STOPs that no gate may have received.

    def _heed(self, message: protocol.FromPage) -> None:
        """Keep a page's STOP, and report who asks to end a STOP or a goal."""
        self._keep_stop_of_page(message)
        if not (b'"reset"' in message.text or b'"cancel"' in message.text):
            return
        try:
            command = commands.parse(message.text)
        except commands.Refusal:
            return  # the gate refuses it, and counts it
        if isinstance(command, commands.Reset | commands.Cancel):
            op: Literal["reset", "cancel"] = (
                "reset" if isinstance(command, commands.Reset) else "cancel"
            )
            who = self._pages.person(message.connection)
            self._report(protocol.PageAsked(command.robot, op, *who))

    def _keep_stop_of_page(self, message: protocol.FromPage) -> None:
        """Keep a page's STOP, in case no gate receives it."""
        stop = stop_in(message.text)
        if stop is None:
            return
        # As in the gate: a STOP that names no known robot is for all.
        known = stop.robot in self._specs
        self._keep_stop(message.connection, stop.robot if known else None)

    def _keep_stop(self, by: str | None, robot: str | None) -> None:
        if not self.ready:
            log.error("STOP: the gate is not running; STOP is sent as soon as it runs")
        self._pending_stops.add(by, robot, time.monotonic())

    def _stop_again(self, by: str | None, robot: str | None) -> protocol.ToGate:
        if by is None or not self._pages.knows(by):
            return FromProgram(commands.Stop(robot))
        text = json.dumps({"op": "stop", "robot": robot or "*"})
        return protocol.FromPage(by, text.encode())

    # The gate.

    def introduction(self) -> list[protocol.ToGate]:
        """Return the first messages for a new gate."""
        stops = [
            self._stop_again(by, robot)
            for by, robot in self._pending_stops
            if robot is None or robot in self._specs  # it may have been removed
        ]
        return [*self._specs.values(), *self._pages.introduction, *stops]

    def hear(self, message: FromGate) -> None:
        """Pass a message of the gate to the pages, the program and the listeners."""
        match message:
            case protocol.Tick(tick):
                self.ticks.note(time.monotonic())
                self._program.on_tick(tick)
                self._pages.on_tick(message)
                with self._lock:
                    self._pending_stops.on_tick(time.monotonic())
            case protocol.RobotReport():
                self._program.on_report(message)
                self._pages.on_report(message)
                self._report(message)
            case protocol.Hello():
                self._pages.on_hello(message)
            case protocol.Refused(connection, robot, what, why):
                self._pages.on_refusal(message)
                if what == "lease" and robot is not None:
                    self._report(protocol.LeaseEnded(robot, why))
                elif what == "reset" and robot is not None:
                    self._report(protocol.PageAsked(robot, "reset", "", None))
                for_page = what == "move" and self._pages.knows(connection)
                if for_page or connection == self._program.connection:
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
                    self._pending_stops.on_gate_ready(time.monotonic())
                self._report(protocol.GateUp())
            case _:  # for listeners alone
                self._report(message)

    def gone(self, down: protocol.GateDown) -> None:
        """Note that the gate has ended, and every lease with it."""
        self.ticks.end()
        self._pages.gone()
        self._program.gone(down.why)
        self._report(down)

    def _report(self, report: Report) -> None:
        for listener in list(self._listeners.values()):
            try:
                listener(report)
            except Exception:
                log.exception("a listener to the gate failed")
