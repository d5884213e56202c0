"""The display's end of the pipe: starts the gate, keeps it running, talks to it.

Every method may be called from any thread and none waits for the gate. Callbacks come
in a thread of the client's own and must be quick.
"""

import concurrent.futures
import itertools
import logging
import math
import threading
import time
from collections.abc import Callable
from typing import get_args

from webmap.errors import ConfigError, MotionError, NoLease
from webmap.gate import messages, reports
from webmap.gate.child import Child
from webmap.gate.messages import PROGRAM, FromGate, Report, RobotSpec, Role
from webmap.gate.specs import checked
from webmap.geometry import Twist
from webmap.scope import Removal

log = logging.getLogger("webmap.gate")

HEARTBEAT = 0.05
"""Seconds between two signs of life to the gate."""

HUNG = 60
"""Heartbeats without a word from a gate that runs until it is taken for hung."""

SLOW_START = 400
"""Heartbeats that a gate may take to say its first word."""

LONGEST_WAIT = 2.0
"""Seconds between two attempts to start the gate at most."""

STOP_TIMEOUT = 2.0
"""Seconds that the gate is given to end; it needs half a second for its zeros."""


class DriveConnection:
    """One page's socket at the gate; made by :meth:`GateClient.connect`."""

    def __init__(
        self,
        client: "GateClient",
        hello: messages.Connect,
        send: Callable[[str], None],
        close: Callable[[str], None],
    ) -> None:
        self.id = hello.connection
        self.greeted = False
        """Whether the gate that runs now has said hello; it is the first word."""
        self._client = client
        self._hello = hello
        self._speeds: messages.Speeds | None = None
        self._send = send
        self._close = close

    def receive(self, text: str | bytes) -> None:
        """Hand over what the page said, whatever it is."""
        # What is not Unicode must arrive as what it is: the gate refuses and counts it.
        data = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
        too_much = 2 * 1024  # refused as too long all the same
        self._client.tell(messages.FromBrowser(self.id, data[:too_much]))

    def set_speeds(self, v: float, w: float) -> None:
        """Set the greatest speeds that the page asks for, in m/s and rad/s."""
        self._speeds = messages.Speeds(self.id, v, w)
        self._client.tell(self._speeds)

    def close(self) -> None:
        """The page is gone: what it drove stops."""
        self._client.drop(self)

    @property
    def introduction(self) -> list[messages.ToGate]:
        """What a gate must hear to know this connection."""
        return [self._hello] if self._speeds is None else [self._hello, self._speeds]

    def say(self, text: str) -> None:
        """Send a text to the page, unless it has not been greeted yet."""
        if self.greeted:
            self._guard(self._send, text)

    def end(self, why: str) -> None:
        """Ask for the page's socket to be closed."""
        self._guard(self._close, why)

    def _guard(self, fn: Callable[[str], None], text: str) -> None:
        try:
            fn(text)
        except Exception:
            log.exception("connection %s: a callback failed", self.id)


class GateClient:
    """Starts the gate and talks to it, and starts it again if it ends.

    Robots that were declared, and connections, are told to every new gate; leases are
    not: they have ended with the old one.
    """

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._child: Child | None = None
        self._ready = False
        self._silent_beats = 0
        self._ending = threading.Event()
        self._supervisor: threading.Thread | None = None
        self._numbers = itertools.count(1)
        self._specs: dict[str, RobotSpec] = {}
        self._connections: dict[str, DriveConnection] = {}
        self._latest: dict[str, messages.RobotReport] = {}
        self._listeners: dict[int, Callable[[Report], None]] = {}
        self._takes: dict[int, concurrent.futures.Future[int]] = {}
        self._epochs: dict[str, int] = {}
        self._tick: int | None = None
        self._undelivered_stops: set[str | None] = set()

    # Life.

    def start(self) -> None:
        """Start the gate and keep it running; the second call does nothing."""
        with self._lock:
            if self._supervisor is not None:
                return
            self._ending.clear()
            self._supervisor = threading.Thread(
                target=self._supervise, name="webmap-gate-heartbeat", daemon=True
            )
            self._supervisor.start()

    def stop(self) -> None:
        """Have every driven robot stopped and the gate ended; returns after that."""
        with self._lock:
            supervisor, self._supervisor = self._supervisor, None
        if supervisor is None:
            return
        self._ending.set()
        supervisor.join()
        with self._lock:
            child, self._child = self._child, None
        if child is not None:
            child.stop(STOP_TIMEOUT)
        self._gone("the gate was ended")

    @property
    def pid(self) -> int | None:
        """The number of the gate's process, if it runs."""
        child = self._child
        return None if child is None else child.pid

    # Robots and pages.

    def declare(self, spec: RobotSpec) -> None:
        """Tell the gate of a robot, or what changed of it.

        Raises:
            ConfigError: If something in ``spec`` cannot be meant.

        """
        spec = checked(spec)
        with self._lock:
            self._specs[spec.id] = spec
            self.tell(spec)

    def forget(self, robot_id: str) -> None:
        """Have the gate drop a robot; it is stopped if it is driven."""
        with self._lock:
            if self._specs.pop(robot_id, None) is not None:
                self.tell(messages.Forget(robot_id))

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
        if role not in get_args(Role):
            raise ConfigError(f"role {role!r} is none of {', '.join(get_args(Role))}")
        with self._lock:
            hello = messages.Connect(f"c{next(self._numbers)}", name, role)
            connection = DriveConnection(self, hello, send, close)
            self._connections[connection.id] = connection
            self.tell(hello)
        return connection

    def drop(self, connection: DriveConnection) -> None:
        """Forget a connection; the second call does nothing."""
        with self._lock:
            if self._connections.pop(connection.id, None) is not None:
                self.tell(messages.Disconnect(connection.id))

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
        future: concurrent.futures.Future[int] = concurrent.futures.Future()
        future.set_running_or_notify_cancel()
        with self._lock:
            if not self._ready:
                future.set_exception(NoLease("the gate does not run (yet)"))
                return future
            request = next(self._numbers)
            self._takes[request] = future
            self.tell(messages.ProgramTake(request, robot_id))
        return future

    def release(self, robot_id: str) -> None:
        """Give the program's lease back; the robot is stopped if it is driven."""
        with self._lock:
            self._epochs.pop(robot_id, None)
            self.tell(messages.ProgramRelease(robot_id))

    def twist(self, robot_id: str, twist: Twist) -> None:
        """Send one velocity; without another within 200 ms the robot is stopped.

        Raises:
            NoLease: If this program does not hold the lease.
            MotionError: If the velocity is not made of finite numbers.

        """
        if not twist.is_finite:
            raise MotionError(f"a velocity is made of finite numbers, got {twist}")
        with self._lock:
            epoch, tick = self._licence(robot_id)
            velocity = (float(twist.vx), float(twist.vy), float(twist.wz))
            self.tell(messages.ProgramTwist(robot_id, epoch, tick, velocity))

    def move(self, robot_id: str, x: float, y: float, yaw: float) -> None:
        """Send a goal: metres and radians in the robot's ``goal_frame``.

        Raises:
            NoLease: If this program does not hold the lease.
            MotionError: If the pose is not made of finite numbers.

        """
        if not all(map(math.isfinite, (x, y, yaw))):
            raise MotionError(f"a pose is made of finite numbers, got {(x, y, yaw)}")
        with self._lock:
            epoch, tick = self._licence(robot_id)
            pose = (float(x), float(y), float(yaw))
            self.tell(messages.ProgramMove(robot_id, epoch, tick, pose))

    def cancel(self, robot_id: str) -> None:
        """Cancel the robot's goals; needs no lease."""
        self.tell(messages.ProgramCancel(robot_id))

    def stop_robot(self, robot_id: str | None) -> None:
        """STOP a robot or, with ``None``, all of them."""
        with self._lock:
            if not self._ready:
                log.error("STOP: the gate does not run; it is told as soon as it does")
                self._undelivered_stops.add(robot_id)
            self.tell(messages.Stop(robot_id))

    def reset(self, robot_id: str | None) -> None:
        """End the STOP of a robot or, with ``None``, of all; moves nothing."""
        with self._lock:
            if self._ready:
                self._undelivered_stops.clear()
                self.tell(messages.Reset(robot_id))
            else:
                log.error("the gate does not run: reset is not kept for later")

    def _licence(self, robot_id: str) -> tuple[int, int]:
        epoch = self._epochs.get(robot_id)
        if epoch is None or self._tick is None:
            raise NoLease(f"this program does not hold the lease of robot {robot_id!r}")
        return epoch, self._tick

    def tell(self, message: messages.ToGate) -> None:
        """Send a message to the gate, if it runs."""
        with self._lock:
            if self._child is not None:
                self._child.send(message)

    # What the gate says.

    def _hear(self, child: Child, message: FromGate) -> None:
        with self._lock:
            if child is not self._child:
                return
            self._silent_beats = 0
        match message:
            case messages.Tick(tick, acks):
                self._tick = tick
                for connection in self._everybody():
                    ack = acks.get(connection.id)
                    if ack is not None:
                        connection.say(reports.tick_text(tick, ack))
            case messages.RobotReport():
                self._hear_robot(message)
            case messages.Hello(id):
                self._greet(id, message)
            case messages.Refused(id):
                self._say_to(id, reports.refused_text(message))
                self._report(message)
            case messages.CloseConnection(id, why):
                found = self._connections.get(id)
                if found is not None:
                    found.end(why)
            case messages.TakeReply():
                self._hear_take(message)
            case messages.RobotGone(robot):
                self._latest.pop(robot, None)
                for connection in self._everybody():
                    connection.say(reports.gone_text(message))
                self._report(message)
            case messages.Ready():
                self._ready = True
                self._report(messages.GateUp())
            case (
                messages.SentTwist() | messages.SentGoal() | messages.RefusedCount()
            ):
                self._report(message)

    def _hear_robot(self, report: messages.RobotReport) -> None:
        holder = None if report.holder is None else report.holder.connection
        with self._lock:
            self._latest[report.robot] = report
            if holder == PROGRAM and report.epoch is not None:
                self._epochs[report.robot] = report.epoch
            else:
                self._epochs.pop(report.robot, None)
        theirs = reports.robot_text(report, mine=False)
        for connection in self._everybody():
            mine = connection.id == holder
            connection.say(reports.robot_text(report, mine=True) if mine else theirs)
        self._report(report)

    def _hear_take(self, reply: messages.TakeReply) -> None:
        with self._lock:
            future = self._takes.pop(reply.request, None)
            if reply.epoch is not None:
                self._epochs[reply.robot] = reply.epoch
        if future is None:
            return
        if reply.epoch is None:
            future.set_exception(NoLease(f"robot {reply.robot!r}: {reply.why}"))
        else:
            future.set_result(reply.epoch)

    def _greet(self, id: str, hello: messages.Hello) -> None:
        with self._lock:
            connection = self._connections.get(id)
        if connection is None:
            return
        connection.greeted = True
        connection.say(reports.hello_text(hello))
        for report in list(self._latest.values()):
            mine = report.holder is not None and report.holder.connection == id
            connection.say(reports.robot_text(report, mine=mine))

    def _say_to(self, id: str, text: str) -> None:
        connection = self._connections.get(id)
        if connection is not None:
            connection.say(text)

    def _everybody(self) -> list[DriveConnection]:
        with self._lock:
            return list(self._connections.values())

    def _report(self, report: Report) -> None:
        for listener in list(self._listeners.values()):
            try:
                listener(report)
            except Exception:
                log.exception("a listener to the gate failed")

    # Keeping it running.

    def _supervise(self) -> None:
        beat, failures, retry_at = messages.Heartbeat(), 0, 0.0
        while not self._ending.is_set():
            child = self._child
            if child is not None:
                failures = 0 if self._ready else failures
                child.send(beat)
                self._check_words(child)
            elif time.monotonic() >= retry_at:
                failures += 1
                retry_at = time.monotonic() + min(LONGEST_WAIT, 0.1 * 2**failures)
                self._spawn()
            self._ending.wait(HEARTBEAT)

    def _check_words(self, child: Child) -> None:
        """Kill a gate that runs and says nothing; counted in our own heartbeats.

        A clock would also count the time in which this process stood still.
        """
        self._silent_beats += 1
        if self._silent_beats > (HUNG if self._ready else SLOW_START):
            self._silent_beats = 0
            child.kill("it says nothing")

    def _spawn(self) -> None:
        try:
            child = Child(self._hear, self._ended)
        except OSError:
            log.exception("the gate cannot be started")
            return
        with self._lock:
            self._child, self._silent_beats = child, 0
            child.send(messages.Heartbeat(), *self._specs.values())
            for connection in self._connections.values():
                child.send(*connection.introduction)
            for robot in self._undelivered_stops:
                child.send(messages.Stop(robot))
            self._undelivered_stops.clear()
        child.start()

    def _ended(self, child: Child) -> None:
        with self._lock:
            if child is not self._child:
                return
            self._child = None
        log.error("the gate (process %d) has ended; it is started anew", child.pid)
        child.stop(STOP_TIMEOUT)
        self._gone("the gate has ended")

    def _gone(self, why: str) -> None:
        with self._lock:
            takes, self._takes = self._takes, {}
            self._ready, self._tick = False, None
            self._epochs.clear()
            self._latest.clear()
            for connection in self._connections.values():
                connection.greeted = False
        for future in takes.values():
            future.set_exception(NoLease(why))
        self._report(messages.GateDown(why))
