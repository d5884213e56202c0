"""The reports that pages receive on ``/drive``.

::

    {"op": "hello", "connection": "c5"}
    {"op": "tick", "tick": 812, "ack": 16}
    {"op": "robot", "robot": "r1", "name": "Bob", "state": "held",
     "holder": {"connection": "c5", "name": "Ann"}, "mine": true, "epoch": 3,
     "latched": false, "stop": null, "armed": false,
     "v": 1.0, "w": 1.5, "why": ["limit of the page"], "link": "up",
     "sent": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "echoed": null,
     "measured": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "alarm": null,
     "other_writer": null, "age": 42.0, "reaction": 0.492, "brake": 0.5,
     "stop_time": 0.25, "stop_source": "stated", "stop_date": null, "test": null,
     "armable": true, "reason": null, "way": "navigate_to_pose", "cancels": true,
     "locates": true, "goal": {"id": "g7", "x": 1.0, "y": 2.0, "yaw": 0.5, "by": "c5",
     "way": "navigate_to_pose", "state": "under way", "why": "", "left": 3.2,
     "time": 4.5, "eta": 5.3, "recoveries": 0}, "hooks": []}
    {"op": "gone", "robot": "r1"}
    {"op": "refused", "robot": "r1", "what": "take", "why": "Ann drives it"}

``hello`` comes first, also when the gate was started anew (all leases are then gone),
and after it every robot. ``tick`` comes at 20 Hz; ``ack`` is the newest accepted
``seq`` of this connection, -1 at first. ``robot`` comes when something changed,
velocities at 10 Hz at most: ``[forward, left, counter-clockwise, upward, about the
forward axis, about the left axis]``, in m/s and rad/s. While STOP stands
``latched`` is true, ``state`` is ``"stopped"``, and ``stop`` tells what is known of it:
``{"by": "Ann", "confirmed": true, "why": "stopped, confirmed by odometry", "id":
"5f0c"}``, with the identity that a reset must name and that is new with each press;
``confirmed`` is null while nobody knows yet and false, with the reason, when nobody
could tell or the robot still moves. ``asker`` is who asks the holder for the lease:
``{"connection": "c6", "name": "Ben", "left": 7.5}`` with the seconds until it is
granted by itself; ``changing`` tells that it goes to somebody else as soon as the robot
stands. ``holder`` and
``epoch`` are null without a lease; ``armed`` says whether a command to move would be
taken now; ``why`` says what binds the speeds ``v`` and ``w`` in force, or, while nobody
has the robot, those that would be if this page took it; ``armable`` and
``reason``, whether it can be taken, and what stands against that or against moving it.
``alarm`` says that the robot moves on a second after zero was sent, ``other_writer``
that another program publishes velocities to it: ``"another program publishes to
/cmd_vel (0.10 m/s, -0.20 rad/s): /teleop"``, with its nodes where they are known. It
comes whether or not somebody drives. ``age`` is the age
of the driver's loop in milliseconds, ``reaction`` the seconds from a finger to the
robot at worst, and ``brake`` the deceleration that is assumed, in m/s². ``stop_time``
is what is known of the base stopping by itself, in seconds: ``"stated"``, or
``"tested"`` on ``stop_date`` (null if it did not stop then). ``test`` tells of the stop
test: ``{"state": "creeping", "text": "..."}``, then ``"waiting"``, ``"done"`` or
``"failed"``. ``way`` is how goals are sent to the robot (null if none can be),
``cancels`` whether they can be called off, ``locates`` whether it can be told where it
is. ``goal`` is the newest one, by the connection ``by``, also when it has ended:
``"sent"``, ``"accepted"``, ``"under way"``, ``"cancelling"``, ``"unknown"`` (what told
of it was lost), ``"reached"``, ``"failed"`` or ``"cancelled"``, with the reason, the
metres and seconds to go, the seconds under way and how often the robot had to free
itself; null is what it does not say. ``hooks`` says which stop hooks failed or are yet
to be said, and why, one sentence each: ``"stop hook /e_stop: no answer within 2 s"``.
``refused`` names the ``op`` (``what``) that was refused, or ``"command"`` for words
that made no sense (``robot`` is then null), or ``"lease"`` when a lease has ended. The
same refusal is said once a second.

What a page may say stands in :mod:`webmap.gate.commands`.
"""

import itertools
import json
import logging
import threading
from collections.abc import Callable
from typing import get_args

import msgspec

from webmap.base.errors import ConfigError
from webmap.gate import protocol
from webmap.gate.limits import Cap, Speed, offered, page_cap
from webmap.gate.protocol import Hello, Refused, RobotGone, RobotReport, Role


def hello_text(hello: Hello) -> str:
    """Return the greeting of a connection."""
    return _text("hello", connection=hello.connection)


def tick_text(tick: int, ack: int) -> str:
    """Return a tick, with what was acknowledged on this connection."""
    return f'{{"op":"tick","tick":{tick},"ack":{ack}}}'


def robot_text(report: RobotReport, *, mine: bool, page: Cap) -> str:
    """Return a report for one page.

    Args:
        report: How it stands with a robot.
        mine: Whether the page has the lease.
        page: What the page asks for at most, which is in force once it has a robot
            that is free now.

    """
    fields = msgspec.to_builtins(report)
    del fields["type"]
    if report.holder is None:
        speed = offered(Speed(report.v, report.w, report.why), page)
        fields |= {"v": speed.v, "w": speed.w, "why": speed.why}
    return _text("robot", mine=mine, **fields)


def gone_text(gone: RobotGone) -> str:
    """Return that a robot is no longer there."""
    return _text("gone", robot=gone.robot)


def refused_text(refused: Refused) -> str:
    """Return that a command was not taken."""
    return _text("refused", robot=refused.robot, what=refused.what, why=refused.why)


def _text(op: str, **fields: object) -> str:
    return json.dumps({"op": op, **fields}, allow_nan=False, separators=(",", ":"))


log = logging.getLogger("webmap.gate")


class DriveConnection:
    """One page's socket at the gate; made by ``GateClient.connect``."""

    def __init__(
        self,
        pages: "Pages",
        hello: protocol.Connect,
        send: Callable[[str], None],
        close: Callable[[str], None],
    ) -> None:
        self.id = hello.connection
        self.greeted = False
        """Whether the gate that runs now has said hello; it is the first word."""
        self._pages = pages
        self._hello = hello
        self._speeds: protocol.Speeds | None = None
        self.cap = page_cap()
        """What the page asks for at most."""
        self._send = send
        self._close = close

    def receive(self, text: str | bytes) -> None:
        """Hand over what the page said, whatever it is."""
        # What is not Unicode must arrive as what it is: the gate refuses and counts it.
        data = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
        too_much = 2 * 1024  # refused as too long all the same
        self._pages.said(self.id, data[:too_much])

    def set_speeds(self, v: float, w: float) -> None:
        """Set the greatest speeds that the page asks for, in m/s and rad/s."""
        self._speeds = protocol.Speeds(self.id, v, w)
        self.cap = page_cap(v, w)
        self._pages.new_speeds(self, self._speeds)

    def close(self) -> None:
        """The page is gone: what it drove stops."""
        self._pages.drop(self)

    @property
    def introduction(self) -> list[protocol.ToGate]:
        """What a gate must hear to know this connection."""
        return [self._hello] if self._speeds is None else [self._hello, self._speeds]

    def say(self, text: str) -> None:
        """Send a text to the page, unless it has not been greeted yet."""
        if self.greeted:
            self._scan_assist(self._send, text)

    def end(self, why: str) -> None:
        """Ask for the page's socket to be closed."""
        self._scan_assist(self._close, why)

    def _scan_assist(self, fn: Callable[[str], None], text: str) -> None:
        try:
            fn(text)
        except Exception:
            log.exception("connection %s: a callback failed", self.id)


class Pages:
    """Every page that speaks with the gate.

    Args:
        send: Sends a message to the gate, if it runs.
        lock: Held while anything here changes.
        heed: Looks at what a page says before the gate does.

    """

    def __init__(
        self,
        send: Callable[[protocol.ToGate], None],
        lock: "threading.RLock",
        heed: Callable[[protocol.FromPage], None],
    ) -> None:
        self.send = send
        self._lock = lock
        self._keep_stop_of_page = heed
        self._numbers = itertools.count(1)
        self._connections: dict[str, DriveConnection] = {}
        self._latest: dict[str, protocol.RobotReport] = {}

    @property
    def introduction(self) -> list[protocol.ToGate]:
        """What a new gate must hear of them."""
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
    ) -> DriveConnection:
        """Introduce a page's socket; see ``GateClient.connect``."""
        if role not in get_args(Role):
            raise ConfigError(f"role {role!r} is none of {', '.join(get_args(Role))}")
        with self._lock:
            hello = protocol.Connect(f"c{next(self._numbers)}", name, role)
            connection = DriveConnection(self, hello, send, close)
            self._connections[connection.id] = connection
            self.send(hello)
        return connection

    def knows(self, id: str) -> bool:
        """Return whether there is a connection of that name."""
        return id in self._connections

    def said(self, id: str, data: bytes) -> None:
        """Hand on what a page says."""
        message = protocol.FromPage(id, data)
        with self._lock:
            self._keep_stop_of_page(message)
            self.send(message)

    def drop(self, connection: DriveConnection) -> None:
        """Forget a connection; the second call does nothing."""
        with self._lock:
            if self._connections.pop(connection.id, None) is not None:
                self.send(protocol.Disconnect(connection.id))

    def new_speeds(self, connection: DriveConnection, speeds: protocol.Speeds) -> None:
        """Tell the gate what a page asks for at most, and the page what it gets."""
        with self._lock:  # so that nothing older comes after what the gate says now
            self.send(speeds)
            for report in list(self._latest.values()):
                if report.holder is None:  # of the one that it has, the gate says so
                    self._show(connection, report)

    # What the gate says.

    def on_tick(self, tick: protocol.Tick) -> None:
        """Tell everybody the newest tick, and how far their words were taken."""
        for connection in self._everybody():
            ack = tick.acks.get(connection.id)
            if ack is not None:
                connection.say(tick_text(tick.tick, ack))

    def on_report(self, report: protocol.RobotReport) -> None:
        """Tell everybody how it stands with a robot."""
        holder = None if report.holder is None else report.holder.connection
        texts: dict[tuple[bool, Cap], str] = {}
        with self._lock:
            self._latest[report.robot] = report
            for connection in self._everybody():
                mine, page = connection.id == holder, connection.cap
                if (mine, page) not in texts:  # most pages are told the same
                    text = robot_text(report, mine=mine, page=page)
                    texts[mine, page] = text
                connection.say(texts[mine, page])

    def on_robot_gone(self, gone: protocol.RobotGone) -> None:
        """Tell everybody that a robot is gone."""
        with self._lock:
            self._latest.pop(gone.robot, None)
        for connection in self._everybody():
            connection.say(gone_text(gone))

    def on_refusal(self, refused: protocol.Refused) -> None:
        """Tell one page what is not done."""
        connection = self._connections.get(refused.connection)
        if connection is not None:
            connection.say(refused_text(refused))

    def on_close(self, close: protocol.CloseConnection) -> None:
        """Have a page's socket closed."""
        connection = self._connections.get(close.connection)
        if connection is not None:
            connection.end(close.why)

    def on_hello(self, hello: protocol.Hello) -> None:
        """Tell a page that the gate knows it, and everything that there is."""
        with self._lock:
            connection = self._connections.get(hello.connection)
            if connection is None:
                return
            connection.greeted = True
            connection.say(hello_text(hello))
            for report in list(self._latest.values()):
                self._show(connection, report)

    def gone(self) -> None:
        """The gate is gone: what it said counts no longer, and the next one greets."""
        with self._lock:
            self._latest.clear()
            for connection in self._connections.values():
                connection.greeted = False

    def _show(self, connection: DriveConnection, report: protocol.RobotReport) -> None:
        holder = None if report.holder is None else report.holder.connection
        mine = holder == connection.id
        connection.say(robot_text(report, mine=mine, page=connection.cap))

    def _everybody(self) -> list[DriveConnection]:
        with self._lock:
            return list(self._connections.values())
