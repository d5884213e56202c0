"""The displays of an agent: which of their messages reach the gate, and when they end.

No I/O: the agent passes samples and times in, and sends what is returned. The agent
trusts no display. A display may connect pages and its program and pass on their
commands, and nothing else: it declares no robot, and the gate decides about every
command as always.

A display is alive while it answers what the agent sends. An answer names the newest
sample that has arrived, so its age is known by the agent's clock alone: an answer to an
old sample, which the network delivers late, is no sign of life.
"""

import logging
from collections import deque
from collections.abc import Mapping

import msgspec

from webmap.agents.samples import Numbering, Order
from webmap.base.errors import WireError
from webmap.gate.commands import ControlCommand, Refusal, check, stop_in
from webmap.gate.protocol import (
    PROGRAM,
    Connect,
    Disconnect,
    FromGate,
    FromPage,
    FromProgram,
    Holder,
    RobotGone,
    RobotReport,
    Role,
    Speeds,
    Tick,
    ToGate,
)

log = logging.getLogger("webmap.agent")

FRESH = 0.3
"""Seconds after which an answer to a sample is no sign of life any more."""

SILENT = 1.0
"""Seconds without a sign of life after which the pages of a display count as lost, if
one of them has control of a robot.

The gate itself stops a robot 200 ms after the last command; this ends control.
"""

IDLE_SILENT = 3.0
"""The same for a display whose pages control nothing: it answers less often."""

PAUSE = 0.2
"""The least time between two times that all reports are sent, in seconds."""

PROGRAM_SILENT = 0.5
"""The same for the program of a display, if it has control of a robot.

A program has no inputs that it could release: after a pause of its display it would
drive on where it was.
"""

MOST_PAGES = 200
"""The greatest number of pages of one display."""


MOST_DISPLAYS = 100
"""The greatest number of displays that an agent remembers."""


class Answer(msgspec.Struct, frozen=True, tag="answer"):
    """A display has received this sample of the agent; sent 1 to 20 times a second."""

    session: int
    number: int
    connections: tuple[str, ...] | None = None
    """The program and all pages that the display has now; once a second.

    A lost message about a page that has closed is made good by this.
    """


class ReportAll(msgspec.Struct, frozen=True, tag="report-all"):
    """A display has lost a sample of the agent, and needs all reports again."""


class AllReports(msgspec.Struct, frozen=True, tag="reports"):
    """The newest report of each robot, in one sample: some of many would be lost."""

    reports: tuple[RobotReport, ...]


class Took(msgspec.Struct, frozen=True, tag="took"):
    """The agent has received this STOP of a display."""

    display: str
    session: int
    number: int


class Unknown(msgspec.Struct, frozen=True, tag="unknown"):
    """The agent does not know these pages of a display, or no longer."""

    display: str
    connections: tuple[str, ...]


ToDisplays = FromGate | AllReports | Took | Unknown
"""What an agent sends to all displays."""

FromDisplay = (
    Connect | Disconnect | FromPage | FromProgram | Speeds | Answer | ReportAll
)
"""What a display may send. Everything else is refused whole."""

_decode = msgspec.msgpack.Decoder(FromDisplay).decode
_encode = msgspec.msgpack.Encoder().encode


class Display:
    """What the agent knows of one display."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.program = f"{name}/{PROGRAM}"
        """The connection of its program."""
        self.order = Order()
        self.wants_reports = False
        """Whether it needs all reports again."""
        self.unknown: tuple[str, ...] = ()
        """Its pages that are not known here."""
        self.alive_at = float("-inf")
        """When it was alive for certain."""
        self.pages: dict[str, list[Connect | Speeds]] = {}
        """The messages that make each of its pages and its program known to a gate, by
        connection."""

    def owns(self, connection: str) -> bool:
        """Return whether a connection has the form that this display may use."""
        return connection.startswith(f"{self.name}/")


class Displays:
    """All displays of one agent.

    Args:
        roles: What the pages of each user of the router may do at most; "" is for the
            others. Without it, all of them may be operators.

    """

    def __init__(self, roles: Mapping[str, Role] | None = None) -> None:
        self._roles = dict(roles or {"": "operator"})
        self._displays: dict[str, Display] = {}
        self._numbering = Numbering()
        self._sent: deque[tuple[int, float]] = deque()
        self._reported_at = float("-inf")
        self._holders: dict[str, tuple[str, float]] = {}
        """The connection that has control of each robot, and since when."""

    @property
    def names(self) -> list[str]:
        """The displays that have pages now."""
        return [name for name, display in self._displays.items() if display.pages]

    def introduction(self) -> list[ToGate]:
        """Return the messages that make all pages known to a new gate."""
        return [
            message
            for display in self._displays.values()
            for messages in display.pages.values()
            for message in messages
        ]

    def wants_reports(self, now: float) -> bool:
        """Return whether a display needs all reports again; then no longer.

        They go to all displays, so those that ask within :data:`PAUSE` get the same.
        """
        wanting = [each for each in self._displays.values() if each.wants_reports]
        if not wanting or now - self._reported_at < PAUSE:
            return False
        for each in wanting:
            each.wants_reports = False
        self._reported_at = now
        return True

    def unknown(self, name: str) -> Unknown | None:
        """Return the pages that a display must introduce again, if there are any."""
        display = self._displays[name]
        connections, display.unknown = display.unknown, ()
        return Unknown(name, connections) if connections else None

    def send(self, message: ToDisplays, now: float) -> bytes:
        """Return the sample that carries a message of the gate to all displays.

        A tick names only the pages that have sent a command: it would grow with every
        page that looks. :class:`FarGate` adds the others.
        """
        match message:
            case Tick(tick, acks):
                message = Tick(tick, {id: ack for id, ack in acks.items() if ack >= 0})
            case RobotReport(robot=robot, holder=Holder(connection)):
                if self._holders.get(robot, ("", 0.0))[0] != connection:
                    self._holders[robot] = (connection, now)
            case RobotReport(robot=robot) | RobotGone(robot):
                self._holders.pop(robot, None)
        sample = self._numbering.next(_encode(message))
        self._sent.append((self._numbering.sent, now))
        while now - self._sent[0][1] > FRESH:
            self._sent.popleft()
        return sample

    def receive(self, name: str, sample: bytes, now: float) -> list[ToGate]:
        """Return what the gate gets from a sample of a display.

        Args:
            name: The display, by the key on which the router accepted the sample.
            sample: The sample.
            now: Seconds, monotonic.

        Raises:
            WireError: If the sample is not one that a display may send.

        """
        display = self._displays.get(name)
        if display is None:
            self._make_room()
            display = self._displays[name] = Display(name)
        body, restarted = display.order.take(sample)
        lost: list[ToGate] = self._end(display) if restarted else []
        if body is None:
            return lost
        try:
            message = _decode(body)
        except (msgspec.DecodeError, RecursionError) as error:
            raise WireError(f"display {name}: got no message: {error}") from error
        match message:
            case Answer():
                self._answered(display, message)
                if message.connections is None:
                    return lost
                return lost + self._end_others(display, message.connections)
            case ReportAll():
                display.wants_reports = True
                return lost
        assert not isinstance(message, Answer | ReportAll)
        if not display.owns(message.connection):
            raise WireError(
                f"display {name}: got the connection {message.connection!r}, "
                f"expected one that begins with {name}/"
            )
        return lost + self._pass_on(display, message, now)

    def look(self, now: float) -> list[ToGate]:
        """Return what ends the pages of displays that give no sign of life."""
        ended: list[ToGate] = []
        holders = dict(self._holders.values())
        for display in self._displays.values():
            controls = holders.keys() & display.pages.keys()
            # Control may begin long after the last answer of an idle display.
            since = [display.alive_at, *(holders[id] for id in controls)]
            silent = now - max(since)
            if display.pages and silent > (SILENT if controls else IDLE_SILENT):
                log.warning("display %s gives no sign of life", display.name)
                ended += self._end(display)
            elif display.program in controls and silent > PROGRAM_SILENT:
                del display.pages[display.program]
                ended.append(Disconnect(display.program))
        return ended

    def _make_room(self) -> None:
        """Forget the oldest display without pages if there are too many."""
        if len(self._displays) < MOST_DISPLAYS:
            return
        empty = [name for name, each in self._displays.items() if not each.pages]
        if not empty:
            raise WireError(f"got more than {MOST_DISPLAYS} displays")
        del self._displays[empty[0]]

    def _answered(self, display: Display, answer: Answer) -> None:
        if answer.session != self._numbering.session:
            return
        for number, at in self._sent:
            if number == answer.number:
                display.alive_at = max(display.alive_at, at)

    def _pass_on(
        self,
        display: Display,
        message: Connect | Disconnect | FromPage | FromProgram | Speeds,
        now: float,
    ) -> list[ToGate]:
        match message:
            case Connect():
                _check_kind(display, message.connection, program=message.program)
                if not display.pages:  # it answers as soon as it gets hello
                    display.alive_at = max(display.alive_at, now)
                if len(display.pages) >= MOST_PAGES:
                    raise WireError(
                        f"display {display.name}: got more than {MOST_PAGES} pages"
                    )
                allowed = self._allowed(display, message)
                display.pages[message.connection] = [allowed]
                return [allowed]
            case Disconnect():
                known = display.pages.pop(message.connection, None)
                return [] if known is None else [message]
            case Speeds():
                known = display.pages.get(message.connection)
                if known is not None:
                    known[1:] = [message]
            case FromProgram():
                _check_program(display, message)
                known = display.pages.get(message.connection)
            case _:
                known = display.pages.get(message.connection)
                if known is None:  # it counts as lost: the display slept
                    stop = stop_in(message.text)
                    if stop is not None:  # it is obeyed all the same
                        return [FromProgram(stop)]
                    display.unknown = (message.connection,)
        return [] if known is None else [message]

    def newest(self, name: str) -> tuple[int, int]:
        """Return session and number of the newest sample of a display."""
        order = self._displays[name].order
        return order.session or 0, order.newest

    def _end_others(self, display: Display, there: tuple[str, ...]) -> list[ToGate]:
        """End the pages that a display no longer has."""
        listed = set(there)
        gone = [each for each in display.pages if each not in listed]
        display.unknown = tuple(each for each in there if each not in display.pages)
        for connection in gone:
            del display.pages[connection]
        return [Disconnect(connection) for connection in gone]

    def _allowed(self, display: Display, connect: Connect) -> Connect:
        """Return a page's introduction with at most the role of its display."""
        order = ("viewer", "operator", "admin")
        user = display.name.partition(".")[0]
        most = self._roles.get(user, self._roles.get("", "viewer"))
        role = min(connect.role, most, key=order.index)
        return msgspec.structs.replace(connect, role=role)

    def _end(self, display: Display) -> list[ToGate]:
        ended: list[ToGate] = [Disconnect(connection) for connection in display.pages]
        display.pages.clear()
        return ended


def _check_kind(display: Display, connection: str, *, program: bool) -> None:
    """Check that the program of a display, and no page, has the program's connection.

    Raises:
        WireError: If not.

    """
    if program != (connection == display.program):
        kind = "a program" if program else "a page"
        raise WireError(f"display {display.name}: got {kind} as {connection!r}")


def _check_program(display: Display, message: FromProgram) -> None:
    """Check a command of the program of a display.

    Raises:
        WireError: If it is none, or a page could not send its values.

    """
    _check_kind(display, message.connection, program=True)
    try:
        if not isinstance(message.command, ControlCommand):
            raise Refusal("it needs no control, so it has the form of a page's")
        check(message.command)
    except Refusal as refusal:
        raise WireError(
            f"display {display.name}: got a command of its program: {refusal.why}"
        ) from refusal
