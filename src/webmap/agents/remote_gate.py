"""The display's side of a gate that runs beside a robot.

It exchanges the same messages as with a gate of its own, as numbered samples. It takes
samples and times and returns samples; ``peer.py`` carries them.
"""

import json
import threading
from collections.abc import Callable

import msgspec
from msgspec.structs import replace

from webmap.agents.gate_messages import (
    MOST_NAME,
    MOST_PAGES,
    AllReports,
    FromDisplay,
    Numbering,
    Order,
    PageState,
    SampleAck,
    StopAck,
    ToDisplays,
)
from webmap.base.errors import WireError
from webmap.base.geometry import Twist
from webmap.gate import commands, protocol
from webmap.gate.commands import robot_in, stop_in
from webmap.gate.display.supervisor import GateListener
from webmap.gate.protocol import MAY_MOVE, RobotReport
from webmap.gate.rules.health import moves

LOST = 0.5
"""Seconds without a sample after which the agent counts as lost."""

AGAIN = 0.1
"""Seconds until a STOP that the agent has not acknowledged is sent again."""

ASK_AGAIN = 0.3
"""Seconds until this display asks again for all reports."""

ANSWER = 1.0
"""Seconds between two answers to the agent while nothing of this display has control
or sends commands, and between two answers with the list of all pages."""

COMMANDING = 1.0
"""Seconds after a command in which each step answers.

The answers then help TCP to notice lost commands, and their age is known sooner.
"""

MOST_WORDS = 300
"""The most characters of an agent's words to a page."""

_decode = msgspec.msgpack.Decoder(ToDisplays).decode
_encode = msgspec.msgpack.Encoder().encode


class RemoteGate:
    """The gate of one agent, as a display knows it.

    Args:
        agent: The name of the agent.
        display: The name of this display.
        owner: Receives the gate's messages.
        lock: Held while the state changes.
        publish: Sends a sample to the agent, without waiting. The number chooses one
            of the connections; None is for all of them.
        router_trouble: Returns why the router is not connected; None if it is.

    """

    pid = None
    """The process is on another computer."""

    def __init__(
        self,
        agent: str,
        display: str,
        owner: GateListener,
        lock: "threading.RLock",
        publish: Callable[[bytes, int | None], None],
        router_trouble: Callable[[], str | None] = lambda: None,
    ) -> None:
        self.agent = agent
        self.display = display
        self.ready = False
        """Whether messages of the gate arrive."""
        self.trouble: str | None = f"waiting for the agent {agent}"
        """Why the gate cannot be reached."""
        self._owner = owner
        self._lock = lock
        self._publish = publish
        self._router_trouble = router_trouble
        self._order = Order()
        self._numbering = Numbering()
        self._heard_at = float("-inf")
        self._robots: dict[str, str] = {}
        """The names of the agent's robots by id: no other robot is passed on."""
        self._pages: dict[str, protocol.Connect] = {}
        self._speeds: dict[str, tuple[float, float]] = {}
        self._greeted: set[str] = set()
        self._commanded: set[str] = set()
        """The connections that sent a command to a robot of this agent: those get its
        words."""
        self._changed = False
        """Whether the agent does not have the newest state of the pages yet."""
        self._reported: set[str] = set()
        """The robots that were reported since the agent was found."""
        self._lacks_reports = False
        """Whether a sample was lost that may have been a report."""
        self._stops: dict[int, tuple[float, protocol.FromPage]] = {}
        """The STOPs without an acknowledgement, by number, each with its time."""
        self._latest: dict[str, RobotReport] = {}
        self._listed_at = self._commanded_at = self._asked_at = float("-inf")

    def start(self) -> None:
        """Do nothing: the gate runs already, or its agent is away."""

    def stop(self) -> None:
        """Disconnect all pages, whose robots stop."""
        with self._lock:
            if self.ready:
                self._answer(())

    @property
    def connection(self) -> str:
        """The identity at the agent's gate of this display's program."""
        return f"{self.display}/{protocol.PROGRAM}"

    def send(self, message: protocol.ToGate) -> None:
        """Send a message to the gate, if it can be reached and takes it from displays.

        The agent itself declares the robots: what it reports of others is left out.
        """
        with self._lock:
            match message:
                case protocol.RobotSpec():
                    if message.id not in self._robots:
                        self._lacks_reports, self._asked_at = True, float("-inf")
                    self._robots[message.id] = message.name
                    return
                case protocol.Forget():
                    self._robots.pop(message.robot, None)
                    self._latest.pop(message.robot, None)
                    self._reported.discard(message.robot)
                    return
                case protocol.Connect(connection):
                    self._pages[connection] = message
                    self._changed = True
                    return
                case protocol.Rename(connection, name):
                    page = self._pages[connection]
                    self._pages[connection] = replace(page, name=name)
                    self._changed = True
                    return
                case protocol.Disconnect(connection):
                    self._pages.pop(connection, None)
                    self._speeds.pop(connection, None)
                    self._greeted.discard(connection)
                    self._changed = True
                    if self.ready and connection in self._commanded:
                        self._list()  # now: its robots must stop
                    self._commanded.discard(connection)
                    return
                case protocol.Speeds(connection, v, w):
                    self._speeds[connection] = (v, w)
                    self._changed = True
                    return
                case protocol.FromProgram(command):
                    robot = command.robot
                    message = self._of_program(message)
                case protocol.FromPage(connection, text):
                    robot = None if connection in self._commanded else robot_in(text)
                case _:
                    return
            if robot in self._latest:
                by = message.connection
                if isinstance(message, protocol.FromProgram):
                    by = getattr(message.command, "page", by)
                self._commanded.add(by)
            self._begin_commands()
            if self.ready:
                if self._changed:
                    self._list()
                self._put(message)

    def take(self, sample: bytes, now: float) -> None:
        """Process a sample of the agent.

        Raises:
            WireError: If it is not a sample.

        """
        with self._lock:
            lost = self._order.lost
            body, restarted = self._order.take(sample)
            if body is None:
                return
            try:
                message = _decode(body)
            except (ValueError, RecursionError) as error:
                raise WireError(
                    f"agent {self.agent}: got no message: {error}"
                ) from error
            self._heard_at = now
            if self.ready and (restarted or isinstance(message, protocol.Ready)):
                self._lose(f"the gate of the agent {self.agent} has restarted")
            if not self.ready:
                self._begin(now)
            elif self._order.lost != lost:
                self._lacks_reports = True
            self._process(message)
            if self._asks_for_reports:
                self._answer()

    def beat(self, now: float) -> None:
        """Answer the newest sample, and note when the agent is silent; at 20 Hz."""
        with self._lock:
            if now - self._heard_at > LOST:
                self._note_silence()
            due = now - self._listed_at >= ANSWER
            if due:
                self._listed_at = now
            if not self.ready:
                if due:
                    self._answer()
                return
            for number, (at, stop) in list(self._stops.items()):
                if now - at >= AGAIN:
                    del self._stops[number]
                    self._put(stop, now)
            if due or self._changed:
                self._list(idle=not self._changed and not self._commands(now))
            elif self._commands(now) or self._asks_for_reports:
                self._answer()

    @property
    def _asks_for_reports(self) -> bool:
        return self._lacks_reports and self._heard_at - self._asked_at >= ASK_AGAIN

    def _commands(self, now: float) -> bool:
        """Return whether this display has control of a robot or sends commands."""
        if now - self._commanded_at < COMMANDING:
            return True
        holders = (each.holder for each in self._latest.values())
        own = f"{self.display}/"
        return any(each and each.connection.startswith(own) for each in holders)

    def _begin_commands(self) -> None:
        """Answer at once if this display was idle.

        Its last answer may be too old for the control that it may get.
        """
        if self.ready and not self._commands(self._heard_at):
            self._answer()
        self._commanded_at = self._heard_at

    def _answer(
        self, pages: tuple[PageState, ...] | None = None, *, idle: bool = False
    ) -> None:
        """Name the newest sample of the agent, if there was one.

        An idle display sends it over one of the connections, in turn: each message
        costs the agent, whatever the number of displays.
        """
        if self._order.session is None:
            return
        asks = self._asks_for_reports
        if asks:
            self._asked_at = self._heard_at
        answer = SampleAck(self._order.session, self._order.newest, pages, asks)
        self._put(answer, only=self._numbering.sent if idle else None)

    def _list(self, *, idle: bool = False) -> None:
        """Send the agent the whole state of the pages and of the program."""
        self._changed = False
        program = PageState(protocol.PROGRAM, f"program of {self.display}", "operator")
        pages = [
            PageState(
                id.removeprefix(f"{self.display}/"),
                page.name[:MOST_NAME],
                page.role,
                self._speeds.get(id),
                id in self._greeted,
                *((who.person, who.page) if (who := page.identity) else ()),
            )
            for id, page in list(self._pages.items())[: MOST_PAGES - 1]
        ]
        self._answer((program, *pages), idle=idle)

    def _begin(self, now: float) -> None:
        """Begin a session: the agent ends what was connected and controlled before."""
        self.ready, self.trouble, self._listed_at = True, None, now
        self._greeted.clear()
        self._commanded.clear()
        self._reported.clear()
        self._lacks_reports, self._asked_at = True, float("-inf")
        self._numbering, self._changed = Numbering(), True
        stops, self._stops = list(self._stops.values()), {}
        for each in self._owner.introduction():
            self.send(each)
        if self._changed:
            self._list()
        for _, stop in stops:
            self._put(stop)
        self._owner.hear(protocol.Ready(0))

    def _process(self, message: ToDisplays) -> None:
        robot = getattr(message, "robot", None)
        if robot is not None and robot not in self._robots:
            return
        match message:
            case protocol.Ready() | protocol.CloseConnection():
                return  # the page has robots of other gates too
            case StopAck():
                if (message.display, message.session) == (
                    self.display,
                    self._numbering.session,
                ):
                    self._stops.pop(message.number, None)
                return
            case protocol.Tick():
                quiet = dict.fromkeys(self._greeted, -1)
                message = protocol.Tick(message.tick, quiet | message.acks)
            case protocol.Hello(connection):
                if connection not in self._pages:
                    return
                self._greeted.add(connection)
            case AllReports(reports, robots):
                self._lacks_reports, self._asked_at = False, float("-inf")
                for robot in self._reported.difference(robots):
                    self._process(protocol.RobotGone(robot))
                for report in reports:
                    self._process(report)
                return
            case protocol.RobotReport():
                message = replace(message, name=self._robots[message.robot])
                self._latest[message.robot] = message
                self._reported.add(message.robot)
            case protocol.RobotGone():
                self._latest.pop(message.robot, None)
                self._reported.discard(message.robot)
            case protocol.Refused(connection, robot, what, why):
                if connection not in self._commanded:
                    return
                about = robot if robot in self._latest else None
                why = f"agent {self.agent}: {why[:MOST_WORDS]}"
                message = protocol.Refused(connection, about, what, why)
            case protocol.RefusedCount(by, count, last):
                last = f"{by[:MOST_NAME]}: {last[:MOST_WORDS]}"
                by = f"the agent {self.agent}"  # one row, whatever names it makes up
                message = protocol.RefusedCount(by, count, last)
        self._owner.hear(message)

    def _put(
        self, message: FromDisplay, now: float | None = None, only: int | None = None
    ) -> None:
        sample = self._numbering.next(_encode(message))
        match message:
            case protocol.FromPage(text=text) if b"stop" in text and stop_in(text):
                at = self._heard_at if now is None else now
                self._stops[self._numbering.sent] = (at, message)
        self._publish(sample, only)

    def _of_program(
        self, message: protocol.FromProgram
    ) -> protocol.FromPage | protocol.FromProgram:
        """Return a command of the program as the agent takes it.

        What needs no control has the form of a page's command: such a STOP is sent
        again until the agent has it, and is for all robots if its own is unknown there.
        """
        match message.command:
            case commands.Stop(robot):
                fields = {"op": "stop", "robot": robot or "*"}
            case commands.Reset(robot, stop):
                fields = {"op": "reset", "robot": robot, "stop": stop}
            case commands.Cancel(robot):
                fields = {"op": "cancel", "robot": robot}
            case _:
                return replace(message, connection=self.connection)
        return protocol.FromPage(self.connection, json.dumps(fields).encode())

    def _note_silence(self) -> None:
        """Report that nothing comes from the agent, and why if that changes."""
        why = self._router_trouble() or f"no connection to the agent {self.agent}"
        if self.ready:
            self._lose(why, silent=True)
        elif self._latest and why != self.trouble:
            self.trouble = why
            self._report_unreachable(why, silent=True)

    def _lose(self, why: str, *, silent: bool = False) -> None:
        """Report the loss of the agent; ``silent`` if nothing comes from its gate."""
        self.ready, self.trouble = False, why
        self._report_unreachable(why, silent=silent)
        self._owner.gone(protocol.GateDown(why))

    def _report_unreachable(self, why: str, *, silent: bool) -> None:
        for report in list(self._latest.values()):
            driven = silent and self._drives(report)
            self._owner.hear(unreachable(report, why, driven=driven))

    def _drives(self, report: RobotReport) -> bool:
        """Return whether this display moved a robot, which perhaps got no zero yet."""
        holder, seen = report.holder, report.measured
        if holder is None or not holder.connection.startswith(f"{self.display}/"):
            return False
        moving = seen is not None and moves(Twist(*seen))
        return moving or report.state in ("driving", "stopping")


def unreachable(report: RobotReport, why: str, *, driven: bool = False) -> RobotReport:
    """Return the report of a robot whose agent cannot be reached.

    What the robot does is unknown; a STOP that was active stays so. If this display has
    ``driven`` it, perhaps nothing but the robot itself can stop it any more (S21).
    """
    alarm, stop_time = None, report.stop_time
    if driven and stop_time is None:
        alarm = MAY_MOVE
    elif driven:
        why = f"{why}: the base stops by its own command timeout of {stop_time:.2f} s"
    return replace(
        report,
        alarm=alarm,
        doing="down",
        holder=None,
        epoch=None,
        asker=None,
        changing=False,
        armed=False,
        armable=False,
        link="down",
        echoed=None,
        measured=None,
        reason=why,
    )
