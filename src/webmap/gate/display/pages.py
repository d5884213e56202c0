"""The pages' sockets at the gate, and what each of them is told."""

import itertools
import logging
import threading
from collections.abc import Callable
from typing import get_args

from webmap.base.errors import ConfigError
from webmap.gate import messages, reports
from webmap.gate.limits import Cap, page_cap
from webmap.gate.messages import Role

log = logging.getLogger("webmap.gate")


class DriveConnection:
    """One page's socket at the gate; made by ``GateClient.connect``."""

    def __init__(
        self,
        pages: "Pages",
        hello: messages.Connect,
        send: Callable[[str], None],
        close: Callable[[str], None],
    ) -> None:
        self.id = hello.connection
        self.greeted = False
        """Whether the gate that runs now has said hello; it is the first word."""
        self._pages = pages
        self._hello = hello
        self._speeds: messages.Speeds | None = None
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
        self._speeds = messages.Speeds(self.id, v, w)
        self.cap = page_cap(v, w)
        self._pages.new_speeds(self, self._speeds)

    def close(self) -> None:
        """The page is gone: what it drove stops."""
        self._pages.drop(self)

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


class Pages:
    """Every page that speaks with the gate.

    Args:
        tell: Sends a message to the gate, if it runs.
        lock: Held while anything here changes.
        heed: Looks at what a page says before the gate does.

    """

    def __init__(
        self,
        tell: Callable[[messages.ToGate], None],
        lock: "threading.RLock",
        heed: Callable[[messages.FromBrowser], None],
    ) -> None:
        self.tell = tell
        self._lock = lock
        self._heed = heed
        self._numbers = itertools.count(1)
        self._connections: dict[str, DriveConnection] = {}
        self._latest: dict[str, messages.RobotReport] = {}

    @property
    def introduction(self) -> list[messages.ToGate]:
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
            hello = messages.Connect(f"c{next(self._numbers)}", name, role)
            connection = DriveConnection(self, hello, send, close)
            self._connections[connection.id] = connection
            self.tell(hello)
        return connection

    def knows(self, id: str) -> bool:
        """Return whether there is a connection of that name."""
        return id in self._connections

    def said(self, id: str, data: bytes) -> None:
        """Hand on what a page says."""
        message = messages.FromBrowser(id, data)
        with self._lock:
            self._heed(message)
            self.tell(message)

    def drop(self, connection: DriveConnection) -> None:
        """Forget a connection; the second call does nothing."""
        with self._lock:
            if self._connections.pop(connection.id, None) is not None:
                self.tell(messages.Disconnect(connection.id))

    def new_speeds(self, connection: DriveConnection, speeds: messages.Speeds) -> None:
        """Tell the gate what a page asks for at most, and the page what it gets."""
        with self._lock:  # so that nothing older comes after what the gate says now
            self.tell(speeds)
            for report in list(self._latest.values()):
                if report.holder is None:  # of the one that it has, the gate says so
                    self._show(connection, report)

    # What the gate says.

    def hear_tick(self, tick: messages.Tick) -> None:
        """Tell everybody the newest tick, and how far their words were taken."""
        for connection in self._everybody():
            ack = tick.acks.get(connection.id)
            if ack is not None:
                connection.say(reports.tick_text(tick.tick, ack))

    def hear_robot(self, report: messages.RobotReport) -> None:
        """Tell everybody how it stands with a robot."""
        holder = None if report.holder is None else report.holder.connection
        texts: dict[tuple[bool, Cap], str] = {}
        with self._lock:
            self._latest[report.robot] = report
            for connection in self._everybody():
                mine, page = connection.id == holder, connection.cap
                if (mine, page) not in texts:  # most pages are told the same
                    text = reports.robot_text(report, mine=mine, page=page)
                    texts[mine, page] = text
                connection.say(texts[mine, page])

    def hear_gone(self, gone: messages.RobotGone) -> None:
        """Tell everybody that a robot is gone."""
        with self._lock:
            self._latest.pop(gone.robot, None)
        for connection in self._everybody():
            connection.say(reports.gone_text(gone))

    def hear_refusal(self, refused: messages.Refused) -> None:
        """Tell one page what is not done."""
        connection = self._connections.get(refused.connection)
        if connection is not None:
            connection.say(reports.refused_text(refused))

    def hear_close(self, close: messages.CloseConnection) -> None:
        """Have a page's socket closed."""
        connection = self._connections.get(close.connection)
        if connection is not None:
            connection.end(close.why)

    def greet(self, hello: messages.Hello) -> None:
        """Tell a page that the gate knows it, and everything that there is."""
        with self._lock:
            connection = self._connections.get(hello.connection)
            if connection is None:
                return
            connection.greeted = True
            connection.say(reports.hello_text(hello))
            for report in list(self._latest.values()):
                self._show(connection, report)

    def gone(self) -> None:
        """The gate is gone: what it said counts no longer, and the next one greets."""
        with self._lock:
            self._latest.clear()
            for connection in self._connections.values():
                connection.greeted = False

    def _show(self, connection: DriveConnection, report: messages.RobotReport) -> None:
        holder = None if report.holder is None else report.holder.connection
        mine = holder == connection.id
        connection.say(reports.robot_text(report, mine=mine, page=connection.cap))

    def _everybody(self) -> list[DriveConnection]:
        with self._lock:
            return list(self._connections.values())
