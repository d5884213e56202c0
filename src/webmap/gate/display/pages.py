"""The messages that the gate sends to pages on ``/drive``.

::

    {"op": "hello", "connection": "c5", "ticks": 20}
    {"op": "you", "name": "Ann (desk 4)", "person": "91c2", "page": "0b7e"}
    {"op": "tick", "tick": 812, "ack": 16}
    {"op": "robot", "robot": "r1", "name": "Bob", "state": "held",
     "holder": {"connection": "c5", "name": "Ann"}, "mine": true, "epoch": 3,
     "latched": false, "stop": null, "armed": false,
     "v": 1.0, "w": 1.5, "why": ["normal limit"], "link": "up",
     "sent": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "echoed": null,
     "measured": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "alarm": null,
     "other_writer": null, "age": 42.0, "reaction": 0.492, "brake": 0.5,
     "stop_time": 0.25, "stop_source": "stated", "stop_date": null, "test": null,
     "armable": true, "reason": null, "method": "navigate_to_pose", "cancels": true,
     "locates": true, "goal": {"id": "g7", "x": 1.0, "y": 2.0, "yaw": 0.5, "by": "c5",
     "method": "navigate_to_pose", "state": "under way", "why": "", "left": 3.2,
     "time": 4.5, "eta": 5.3, "recoveries": 0}, "hooks": []}
    {"op": "gone", "robot": "r1"}
    {"op": "refused", "robot": "r1", "what": "take", "why": "Ann drives it"}

``hello`` comes first, also after the gate was restarted (all leases have then ended),
and after it ``you``, with the name that others see and
the identity of the person and the page, and a ``robot`` for every robot. ``you`` comes
again with another name. ``tick`` comes ``ticks`` times a second: 20,
or 2 to a page of a viewer, which may only stop; ``ack`` is the newest accepted ``seq``
of this connection, -1 at first. ``gone`` means that the robot was removed. ``robot``
comes when something changed, velocities at 10 Hz at most. Its fields:

``state``, ``latched``, ``stop``
    While STOP is active, ``latched`` is true, ``state`` is ``"stopped"`` and ``stop``
    describes it: ``{"by": "Ann", "confirmed": true, "why": "stopped, confirmed by
    odometry", "id": "5f0c"}``. A reset must name the ``id``, which is new with each
    press. ``confirmed`` is null while standstill is not known yet, and false, with the
    reason, if it could not be checked or the robot still moves.
``holder``, ``mine``, ``epoch``
    The lease; ``holder`` and ``epoch`` are null without one. Who has control, requests
    it or pressed STOP has an ``identity`` too, if it is a person: ``{"person": "91c2",
    "page": "0b7e"}``, as in ``you``.
``asker``, ``changing``
    Who requests control: ``{"connection": "c6", "name": "Ben", "left": 7.5}``, with the
    seconds until it is granted without an answer. ``changing`` means that the lease
    passes to another operator as soon as the machine has stopped.
``armed``, ``armable``, ``reason``
    Whether a command to move would be accepted now, whether control can be taken, and
    the reason against control or against motion.
``v``, ``w``, ``why``
    The speeds in force and what limits them; while the robot is free, those that would
    be in force if this page took it.
``sent``, ``echoed``, ``measured``
    Velocities ``[forward, left, counter-clockwise, upward, about the forward axis,
    about the left axis]``, in m/s and rad/s.
``alarm``
    The robot still moves a second after zero was sent.
``other_writer``
    Another program publishes velocities to the robot, whether or not an operator
    drives: ``"another program publishes to /cmd_vel (0.10 m/s, -0.20 rad/s):
    /teleop"``, with its nodes where they are known.
``age``, ``reaction``, ``brake``
    The age of the operator's control loop in milliseconds, the longest time from a
    finger to the robot in seconds, and the assumed deceleration in m/s².
``stop_time``, ``stop_source``, ``stop_date``
    The seconds in which the base stops by itself, ``"stated"`` or ``"tested"`` on
    ``stop_date``; null if it did not stop in the test.
``test``
    The stop test: ``{"state": "creeping", "text": "..."}``, then ``"waiting"``,
    ``"done"`` or ``"failed"``.
``method``, ``cancels``, ``locates``
    How goals are sent to the robot (null if it accepts none), whether they can be
    cancelled, and whether the robot accepts a pose.
``goal``
    The newest goal, sent by the connection ``by``, also after its end: ``"sent"``,
    ``"accepted"``, ``"under way"``, ``"cancelling"``, ``"unknown"`` (the link that
    reported on it was lost), ``"reached"``, ``"failed"`` or ``"cancelled"``, with the
    reason, the metres (``left``) and seconds (``eta``) to go, the seconds under way
    (``time``) and the number of recoveries. What the robot does not report is null.
``hooks``
    The stop hooks that failed or have not run yet, and why, one sentence each:
    ``"stop hook /e_stop: no answer within 2 s"``.

``looks``
    True if the person of the page may only look at this robot and press STOP, and then
    it takes no goals from this page either; left out otherwise.

``refused`` names in ``what`` the refused ``op``, or ``"command"`` for an invalid
command (``robot`` is then null), or ``"lease"`` when a lease has ended. The same
refusal is sent once a second at most.

A tick and a report of a robot whose gate is that of an agent have one more field,
``gate``, with the name of the agent: a command has a tick of the gate of its robot.

:mod:`webmap.gate.commands` has the commands of a page.
"""

import itertools
import logging
import threading
import time
from collections.abc import Callable
from typing import Any, get_args

import msgspec
from msgspec.structs import replace

from webmap.base.errors import ConfigError, MotionError
from webmap.base.roles import NOT_YOURS, Role
from webmap.base.text import isolated
from webmap.gate import protocol
from webmap.gate.commands import MoveFor, Refusal, Release, Stop, op_of, parse
from webmap.gate.protocol import Hello, Identity, Refused, RobotGone, RobotReport
from webmap.gate.specs import Cap, Speed, offered, page_cap


def hello_text(hello: Hello, ticks: int) -> str:
    """Return the first message of a connection.

    Args:
        hello: The gate's hello.
        ticks: Ticks a second.

    """
    return _text("hello", connection=hello.connection, ticks=ticks)


def you_text(name: str, identity: Identity) -> str:
    """Return the message that tells a page who it is for others."""
    person, page = identity.person, identity.page
    return _text("you", name=isolated(name), person=person, page=page)


def tick_text(tick: int, ack: int, agent: str = "") -> str:
    """Return a tick, with the newest accepted ``seq`` of the connection."""
    gate = f',"gate":"{agent}"' if agent else ""
    return f'{{"op":"tick","tick":{tick},"ack":{ack}{gate}}}'


def robot_text(
    report: RobotReport,
    *,
    mine: bool,
    page: Cap,
    looks: bool = False,
    agent: str = "",
    prefix: str = "",
) -> str:
    """Return a robot's report for one page.

    Args:
        report: The report.
        mine: Whether the page has the lease.
        page: The page's own limit, which comes into force when it takes a free robot.
        looks: Whether the person of the page may not drive this robot.
        agent: The agent whose gate it is; "" for the display's own.
        prefix: What the ids of this display's connections begin with at that gate.

    """
    fields = msgspec.to_builtins(report)
    del fields["type"]
    if agent:
        fields["gate"] = agent
    if looks:
        fields |= {"looks": True, "method": None, "cancels": False, "locates": False}
    for key in ("holder", "asker", "stop"):
        if fields[key] is not None:
            _localize(fields[key], prefix)
    if report.holder is None:
        speed = offered(Speed(report.v, report.w, report.why), page)
        fields |= {"v": speed.v, "w": speed.w, "why": speed.why}
    return _text("robot", mine=mine, **fields)


def _localize(who: dict[str, Any], prefix: str) -> None:
    """Name a person in a report as this display does, without its own prefix."""
    name = "by" if "by" in who else "name"
    who[name] = isolated(who[name])
    own = who.get("connection", "")
    if prefix and own.startswith(prefix):
        who["connection"] = own.removeprefix(prefix).partition(".")[0]
    if identity := who.get("identity"):
        identity["person"] = identity["person"].removeprefix(prefix)


def gone_text(gone: RobotGone) -> str:
    """Return the message that a robot was removed."""
    return _text("gone", robot=gone.robot)


def refused_text(refused: Refused) -> str:
    """Return the message that a command was refused."""
    return _text("refused", robot=refused.robot, what=refused.what, why=refused.why)


def _text(op: str, **fields: object) -> str:
    return msgspec.json.encode({"op": op, **fields}).decode()


log = logging.getLogger("webmap.gate")

COUNT_EVERY = 1.0
"""Seconds between two reports of how many messages of a page were refused here."""

TICKS = 20
"""Ticks a second."""

TICKS_TO_VIEWERS = 2
"""Ticks a second for a page that may not drive: they only show that it is connected."""


class DriveConnection:
    """One page's socket at the gate; made by ``GateClient.connect``."""

    def __init__(
        self,
        pages: "Pages",
        hello: protocol.Connect,
        send: Callable[[str], None],
        close: Callable[[str], None],
        may_drive: Callable[[str], bool] | None = None,
    ) -> None:
        self.id = hello.connection
        self.greeted = False
        """Whether the present gate has sent hello, which must be the first message."""
        self._pages = pages
        self._hello = hello
        self.ticks = TICKS_TO_VIEWERS if hello.role == "viewer" else TICKS
        """Ticks a second."""
        self._speeds: protocol.Speeds | None = None
        self.cap = page_cap()
        """The page's own limit."""
        self._send = send
        self._close = close
        self._may_drive = may_drive
        self._refused, self._counted_at = 0, float("-inf")

    def receive(self, text: str | bytes) -> None:
        """Pass a frame of the page to the gate, valid or not.

        What commands a robot that the person may not drive ends here.
        """
        # Text that is not Unicode is passed on, too: the gate refuses and counts it.
        data = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
        data = data[: 2 * 1024]  # refused as too long all the same
        refused = None if self._may_drive is None else self._refusal(data)
        if refused is None:
            self._pages.forward(self.id, data)
        else:
            self._count(refused)
            self.send_text(refused_text(refused))

    def looks_at(self, robot: str) -> bool:
        """Return whether the person may not drive a robot, only look and stop it."""
        return self._may_drive is not None and not self._may_drive(robot)

    def _refusal(self, data: bytes) -> Refused | None:
        """Return the refusal of a message; None if the gate decides about it.

        Everybody may stop a robot, and let it go.
        """
        try:
            command = parse(data)
        except Refusal:
            return None  # the gate refuses it, and obeys a STOP that is malformed
        if isinstance(command, Stop | Release) or not self.looks_at(command.robot):
            return None
        return Refused(self.id, command.robot, op_of(command), NOT_YOURS)

    def _count(self, refused: Refused) -> None:
        self._refused += 1
        now = time.monotonic()
        if now - self._counted_at >= COUNT_EVERY:
            last = f"{refused.what}: {refused.why}"
            count = protocol.RefusedCount(self._hello.name, self._refused, last)
            self._refused, self._counted_at = 0, now
            self._pages.report(count)

    def set_speeds(self, v: float, w: float) -> None:
        """Set the page's own speed limits, in m/s and rad/s."""
        speeds = protocol.Speeds(self.id, v, w)
        if speeds != self._speeds:  # a page sets them several times while it opens
            self._speeds = speeds
            self.cap = page_cap(v, w)
            self._pages.new_speeds(self, speeds)

    def rename(self, name: str) -> None:
        """Show the person at the page under another name from now on."""
        if name != self._hello.name:
            self._hello = replace(self._hello, name=name)
            self._pages.send(protocol.Rename(self.id, name))
            self.introduce()

    def introduce(self) -> None:
        """Send the page the name of its person, if it has an identity."""
        if self._hello.identity is not None:
            self.send_text(you_text(self._hello.name, self._hello.identity))

    def move(self, robot: str, x: float, y: float, yaw: float) -> None:
        """Send a goal of the program in the name of this page.

        The page keeps control of the robot, or gets it; the gate sends a refusal to the
        page.

        Args:
            robot: The robot.
            x: In metres in the robot's goal frame.
            y: In metres.
            yaw: In radians.

        Raises:
            MotionError: If the gate does not run, or the person may not drive the
                robot.

        """
        if self.looks_at(robot):
            raise MotionError(f"the goal was not sent: {NOT_YOURS}")
        self._pages.move(self.id, robot, (x, y, yaw))

    @property
    def person(self) -> tuple[str, Identity | None]:
        """The name and the identity of the person at the page."""
        return self._hello.name, self._hello.identity

    def close(self) -> None:
        """Remove the page, which has closed; the robots that it drove stop."""
        self._pages.drop(self)

    @property
    def introduction(self) -> list[protocol.ToGate]:
        """The messages that make this connection known to a gate."""
        return [self._hello] if self._speeds is None else [self._hello, self._speeds]

    def send_text(self, text: str) -> None:
        """Send a text to the page, if it has received hello."""
        if self.greeted:
            self._call(self._send, text)

    def end(self, why: str) -> None:
        """Close the page's socket."""
        self._call(self._close, why)

    def _call(self, fn: Callable[[str], None], text: str) -> None:
        try:
            fn(text)
        except Exception:
            log.exception("connection %s: a callback failed", self.id)


class Pages:
    """The pages that are connected to the gate.

    Args:
        send: Sends a message to the gate, if it runs.
        lock: Held while the state changes.
        heed: Called with each message of a page before the gate receives it.
        report: Called with counts of messages that the gate does not receive.
        agent: The agent whose gate it is; "" for the display's own.
        prefix: What the id of each connection begins with.

    """

    def __init__(
        self,
        send: Callable[[protocol.ToGate], None],
        lock: "threading.RLock",
        heed: Callable[[protocol.FromPage], None],
        report: Callable[[protocol.RefusedCount], None],
        agent: str = "",
        prefix: str = "",
    ) -> None:
        self._agent = agent
        self._prefix = prefix
        self.send = send
        self._lock = lock
        self._keep_stop_of_page = heed
        self.report = report
        self._numbers = itertools.count(1)
        self._connections: dict[str, DriveConnection] = {}
        self._latest: dict[str, protocol.RobotReport] = {}
        self._ticks = 0
        self._tick: int | None = None

    @property
    def introduction(self) -> list[protocol.ToGate]:
        """The messages that make all connections known to a new gate."""
        return [
            message
            for connection in self._connections.values()
            for message in connection.introduction
        ]

    def connect(
        self,
        name: str,
        role: Role,
        send: Callable[[str], None],
        close: Callable[[str], None],
        id: str = "",
        identity: Identity | None = None,
        may_drive: Callable[[str], bool] | None = None,
    ) -> DriveConnection:
        """Register a page's socket; see ``GateClient.connect``."""
        if role not in get_args(Role):
            raise ConfigError(f"role {role!r} is none of {', '.join(get_args(Role))}")
        with self._lock:
            number = next(self._numbers)
            own = f"{id}.{number}" if id else f"c{number}"
            hello = protocol.Connect(
                f"{self._prefix}{own}", name, role, identity=identity
            )
            connection = DriveConnection(self, hello, send, close, may_drive)
            self._connections[connection.id] = connection
            self.send(hello)
            if self._agent:  # the page is greeted by the display's own gate
                connection.greeted = True
                self.show_again(connection)
        return connection

    def knows(self, id: str) -> bool:
        """Return whether there is a connection with this id."""
        return id in self._connections

    def person(self, id: str) -> tuple[str, Identity | None]:
        """Return the name and the identity of the person at a page."""
        connection = self._connections.get(id)
        return ("", None) if connection is None else connection.person

    def forward(self, id: str, data: bytes) -> None:
        """Pass a page's frame to the gate."""
        message = protocol.FromPage(id, data)
        with self._lock:
            self._keep_stop_of_page(message)
            self.send(message)

    def move(self, id: str, robot: str, pose: tuple[float, float, float]) -> None:
        """Send a goal in the name of a page; see ``DriveConnection.move``."""
        with self._lock:
            if self._tick is None:
                raise MotionError("the goal was not sent: the gate is not running")
            command = MoveFor(robot, id, self._tick, *pose)
            self.send(protocol.FromProgram(command))

    def drop(self, connection: DriveConnection) -> None:
        """Remove a connection; a second call does nothing."""
        with self._lock:
            if self._connections.pop(connection.id, None) is not None:
                self.send(protocol.Disconnect(connection.id))

    def new_speeds(self, connection: DriveConnection, speeds: protocol.Speeds) -> None:
        """Send a page's limits to the gate, and the resulting speeds to the page."""
        with self._lock:  # so that no older report follows a newer one
            self.send(speeds)
            for report in list(self._latest.values()):
                if report.holder is None:  # for a held robot, the gate reports them
                    self._show(connection, report)

    # Messages from the gate.

    def on_tick(self, tick: protocol.Tick) -> None:
        """Send each page the newest tick, with its newest accepted ``seq``."""
        self._ticks += 1
        self._tick = tick.tick
        for connection in self._all():
            ack = tick.acks.get(connection.id)
            if ack is not None and self._ticks % (TICKS // connection.ticks) == 0:
                connection.send_text(tick_text(tick.tick, ack, self._agent))

    def on_report(self, report: protocol.RobotReport) -> None:
        """Send a robot's report to all pages."""
        holder = None if report.holder is None else report.holder.connection
        texts: dict[tuple[bool, bool, Cap], str] = {}
        with self._lock:
            self._latest[report.robot] = report
            for connection in self._all():
                mine, page = connection.id == holder, connection.cap
                key = mine, connection.looks_at(report.robot), page
                if key not in texts:  # most pages receive the same text
                    texts[key] = self._text(report, *key)
                connection.send_text(texts[key])

    def on_robot_gone(self, gone: protocol.RobotGone) -> None:
        """Report to all pages that a robot was removed."""
        with self._lock:
            self._latest.pop(gone.robot, None)
        for connection in self._all():
            connection.send_text(gone_text(gone))

    def on_refusal(self, refused: protocol.Refused) -> None:
        """Send a refusal to its page, unless that has closed."""
        connection = self._connections.get(refused.connection)
        if connection is not None:
            connection.send_text(refused_text(refused))

    def on_close(self, close: protocol.CloseConnection) -> None:
        """Close a page's socket for the gate."""
        connection = self._connections.get(close.connection)
        if connection is not None:
            connection.end(close.why)

    def on_hello(self, hello: protocol.Hello) -> None:
        """Send a page hello and the newest report of every robot."""
        with self._lock:
            connection = self._connections.get(hello.connection)
            if connection is None:
                return
            connection.greeted = True
            if not self._agent:  # a page is greeted by the display's own gate alone
                connection.send_text(hello_text(hello, connection.ticks))
                connection.introduce()
            for report in list(self._latest.values()):
                self._show(connection, report)

    def gone(self) -> None:
        """Discard the reports of a gate that has ended; the next one sends hello.

        Robots of an agent stay, and are reported as unreachable.
        """
        self._tick = None
        if self._agent:
            return
        with self._lock:
            self._latest.clear()
            for connection in self._connections.values():
                connection.greeted = False

    def _show(self, connection: DriveConnection, report: protocol.RobotReport) -> None:
        if not connection.greeted:
            return
        holder = None if report.holder is None else report.holder.connection
        looks, mine = connection.looks_at(report.robot), holder == connection.id
        connection.send_text(self._text(report, mine, looks, connection.cap))

    def _text(self, report: RobotReport, mine: bool, looks: bool, page: Cap) -> str:
        return robot_text(
            report,
            mine=mine,
            page=page,
            looks=looks,
            agent=self._agent,
            prefix=self._prefix,
        )

    def show_again(self, connection: DriveConnection) -> None:
        """Send a page the newest report of every robot."""
        with self._lock:
            for report in list(self._latest.values()):
                self._show(connection, report)

    @property
    def latest(self) -> list[protocol.RobotReport]:
        """The newest report of every robot."""
        with self._lock:
            return list(self._latest.values())

    def _all(self) -> list[DriveConnection]:
        with self._lock:
            return list(self._connections.values())
