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
from msgspec.structs import replace

from webmap.agents.gate_messages import (
    HEAD_BYTES,
    MOST_PAGES,
    FromDisplay,
    Numbering,
    Order,
    PageState,
    SampleAck,
    StopAck,
    ToDisplays,
    head_of,
)
from webmap.base.errors import WireError
from webmap.base.roles import Role
from webmap.gate.commands import ControlCommand, Refusal, Stop, check, stop_in
from webmap.gate.lanes.budget import BYTES, FRAMES, Budget
from webmap.gate.protocol import (
    PROGRAM,
    Connect,
    Disconnect,
    FromPage,
    FromProgram,
    Hello,
    Identity,
    Ready,
    Rename,
    RobotGone,
    RobotReport,
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

MOST_COMMAND = 3 << 10
"""The longest sample of a display with a command, in bytes."""

MOST_PAGES_OF_USER = 1000
"""The greatest number of pages of all displays of one user."""

MOST_DISPLAYS = 100
"""The greatest number of displays of one user that an agent remembers."""

MOST_USERS = 20
"""The greatest number of users with limits of their own; all others share theirs."""

OF_USER, OF_DISPLAY = 2, 4
"""The parts of the :class:`Budget` of a link that a user and a display have: a half
(2000 samples and 8 MiB a second) and a quarter. Both copies of a sample count."""

STOP_PAUSE = 0.05
"""Seconds after a STOP of a user in which another one for the same robot waits for the
next tick. The gate gets one for all that wait, however many come."""


Effect = ToGate | StopAck | Hello
"""What a sample of a display causes: for the gate, or for all displays."""

_decode = msgspec.msgpack.Decoder(FromDisplay).decode
_encode = msgspec.msgpack.Encoder().encode


class UserDisplays:
    """The displays of one user of the router, and what limits them together."""

    def __init__(self) -> None:
        self.displays: dict[str, Display] = {}
        self.budget = Budget(FRAMES // OF_USER, BYTES // OF_USER)
        self.stops: deque[tuple[str, int, int]] = deque(maxlen=100)
        """The newest STOPs that were obeyed: display, session and number of each."""
        self.stopped_at: dict[str | None, float] = {}
        """When a STOP went to the gate at once, by robot; None is for all."""


class Display:
    """What the agent knows of one display."""

    def __init__(self, name: str, user: UserDisplays) -> None:
        self.name = name
        self.user = user
        self.program = f"{name}/{PROGRAM}"
        """The connection of its program."""
        self.order = Order()
        self.budget = Budget(FRAMES // OF_DISPLAY, BYTES // OF_DISPLAY)
        self.alive_at = float("-inf")
        """When it was alive for certain."""
        self.pages: dict[str, list[Connect | Speeds]] = {}
        """The messages that make each of its pages and its program known to a gate, by
        connection."""

    def spend(self, count: int, size: int, now: float) -> None:
        """Count messages of this display, with their bytes."""
        for budget in (self.user.budget, self.budget):
            budget.spend(count, size, 0.0, now)


class Displays:
    """All displays of one agent.

    Args:
        roles: What the pages of each user of the router may do at most; "" is for the
            others. Without it, all of them may be operators.

    """

    def __init__(self, roles: Mapping[str, Role] | None = None) -> None:
        self._roles: dict[str, Role] = dict(roles or {"": "operator"})
        self._users = {"": UserDisplays()}
        """Users of the router; "" is for those above :data:`MOST_USERS`."""
        self._numbering = Numbering()
        self._sent: deque[tuple[int, float]] = deque()
        self._wanted = False
        """Whether a display needs all reports again."""
        self._reported_at = float("-inf")
        self._robots: set[str] = set()
        self._holders: dict[str, tuple[str, float]] = {}
        """The connection that has control of each robot, and since when."""
        self._greeted: set[str] = set()
        """The pages that the gate knows."""
        self._waiting: set[str | None] = set()
        """The robots for which a STOP waits for the next tick; None is for all."""

    @property
    def _displays(self) -> list[Display]:
        return [
            each for user in self._users.values() for each in user.displays.values()
        ]

    def introduction(self) -> list[ToGate]:
        """Return the messages that make all pages known to a new gate."""
        return [
            message
            for display in self._displays
            for messages in display.pages.values()
            for message in messages
        ]

    def wants_reports(self, now: float) -> bool:
        """Return whether a display needs all reports again; then no longer.

        They go to all displays, so those that ask within :data:`PAUSE` get the same.
        """
        if not self._wanted or now - self._reported_at < PAUSE:
            return False
        self._wanted, self._reported_at = False, now
        return True

    def send(self, message: ToDisplays, now: float) -> bytes:
        """Return the sample that carries a message of the gate to all displays.

        A tick names only the pages that have sent a command: it would grow with every
        page that only shows. :class:`RemoteGate` adds the others.
        """
        match message:
            case Tick(tick, acks):
                message = Tick(tick, {id: ack for id, ack in acks.items() if ack >= 0})
            case Hello(connection):
                self._greeted.add(connection)
            case Ready():
                self._greeted.clear()
            case RobotReport(robot=robot, holder=holder):
                self._robots.add(robot)
                if holder is None:
                    self._holders.pop(robot, None)
                elif self._holders.get(robot, ("", 0.0))[0] != holder.connection:
                    self._holders[robot] = (holder.connection, now)
            case RobotGone(robot):
                self._robots.discard(robot)
                self._holders.pop(robot, None)
        sample = self._numbering.next(_encode(message))
        self._sent.append((self._numbering.sent, now))
        while now - self._sent[0][1] > FRESH:
            self._sent.popleft()
        return sample

    def receive(self, name: str, sample: bytes, now: float) -> list[Effect]:
        """Return what the gate gets from a sample of a display, and what displays get.

        A STOP is read before any limit and is never refused.

        Args:
            name: The display, by the key on which the router accepted the sample.
            sample: The sample.
            now: Seconds, monotonic.

        Raises:
            WireError: If a display may not send the sample, or it is one too many.

        """
        found = _stop_of(sample)
        if found is not None:
            return self._obey(name, sample, *found, now)
        display = self._display(name)
        if display.user.budget.wait(now) or display.budget.wait(now):
            raise WireError(
                f"display {name} or its user sends too much; all but STOP is dropped: "
                f"{FRAMES // OF_DISPLAY} messages a second at most"
            )
        display.spend(1, len(sample), now)
        # It is checked first: an error must not hide that pages have ended.
        try:
            message = _decode(sample[HEAD_BYTES:])
        except (ValueError, RecursionError) as error:
            raise WireError(f"display {name}: got no message: {error}") from error
        if len(sample) > MOST_COMMAND and not isinstance(message, SampleAck):
            raise WireError(
                f"display {name}: got a command of {len(sample)} bytes, "
                f"expected {MOST_COMMAND} at most"
            )
        if isinstance(message, FromProgram):
            _check_program(display, message)
        body, restarted = display.order.take(sample)
        effects: list[Effect] = list(self._end(display)) if restarted else []
        if body is None:
            return effects
        if not isinstance(message, SampleAck):
            if message.connection in display.pages:  # otherwise it counts as lost
                effects.append(message)
            return effects
        self._answered(display, message)
        self._wanted |= message.reports
        if message.pages is not None:
            changed = self._update(display, message.pages, now)
            display.spend(len(changed), 0, now)
            effects += changed
        return effects

    def waiting_stops(self) -> list[FromProgram]:
        """Return the STOPs that wait for a tick; no acknowledgement is needed."""
        waiting, self._waiting = self._waiting, set()
        return [FromProgram(Stop(robot)) for robot in waiting]

    def check(self, now: float) -> list[Disconnect]:
        """Return what ends the pages of displays that give no sign of life."""
        ended: list[Disconnect] = []
        holders = dict(self._holders.values())
        for display in self._displays:
            controls = holders.keys() & display.pages.keys()
            # Control may begin long after the last answer of an idle display.
            since = [display.alive_at, *(holders[id] for id in controls)]
            silent = now - max(since)
            if display.pages and silent > (SILENT if controls else IDLE_SILENT):
                log.warning("display %s gives no sign of life", display.name)
                ended += self._end(display)
            elif display.program in controls and silent > PROGRAM_SILENT:
                ended.append(self._drop(display, display.program))
        return ended

    def _obey(
        self,
        name: str,
        sample: bytes,
        message: FromPage | FromProgram,
        stop: Stop,
        now: float,
    ) -> list[Effect]:
        """Obey a STOP, whoever sent it and whatever its number is."""
        user = self._user(name)
        session, number = head_of(sample)
        if (name, session, number) in user.stops:
            return []  # the second copy
        user.stops.append((name, session, number))
        robot = stop.robot if stop.robot in self._robots else None
        if now - user.stopped_at.get(robot, float("-inf")) < STOP_PAUSE:
            self._waiting.add(robot)
            return []  # the display sends it once more, as it is not acknowledged
        user.stopped_at[robot] = now
        display = user.displays.get(name)
        known = display is not None and message.connection in display.pages
        if not known or isinstance(message, FromProgram):
            message = FromProgram(Stop(robot))
        return [message, StopAck(name, session, number)]  # the gate first: it must stop

    def _user(self, display: str) -> UserDisplays:
        name = user_of(display)
        if name not in self._users and len(self._users) <= MOST_USERS:
            self._users[name] = UserDisplays()
        return self._users.get(name, self._users[""])

    def _display(self, name: str) -> Display:
        """Return a display, which may be new.

        Raises:
            WireError: If the user has too many.

        """
        user = self._user(name)
        display = user.displays.get(name)
        if display is None:
            if len(user.displays) >= MOST_DISPLAYS:
                empty = [id for id, each in user.displays.items() if not each.pages]
                if not empty:
                    raise WireError(f"{name}: got more than {MOST_DISPLAYS} displays")
                del user.displays[empty[0]]
            display = user.displays[name] = Display(name, user)
        return display

    def _answered(self, display: Display, answer: SampleAck) -> None:
        if answer.session != self._numbering.session:
            return
        for number, at in self._sent:
            if number == answer.number:
                display.alive_at = max(display.alive_at, at)

    def _update(
        self, display: Display, pages: tuple[PageState, ...], now: float
    ) -> list[Effect]:
        """Return what makes the pages of a display known with all their state."""
        there = {f"{display.name}/{page.id}": page for page in pages}
        changed: list[Effect] = [
            self._drop(display, id) for id in list(display.pages) if id not in there
        ]
        if not display.pages:  # it answers as soon as it gets hello
            display.alive_at = max(display.alive_at, now)
        of_user = sum(len(each.pages) for each in display.user.displays.values())
        room = min(MOST_PAGES - len(display.pages), MOST_PAGES_OF_USER - of_user)
        for connection, page in there.items():
            known = display.pages.get(connection)
            if known is None:
                room -= 1
                if room < 0:
                    continue  # it may stop robots, and nothing else
            state = self._state(display, connection, page)
            display.pages[connection] = state
            if known is None:
                changed += state
            elif known != state:
                changed += _changes(known, state)
            elif not page.greeted and connection in self._greeted:
                changed.append(Hello(connection))  # the first was lost
        if room < 0:
            log.warning("display %s has %d pages too many", display.name, -room)
        return changed

    def _state(
        self, display: Display, connection: str, page: PageState
    ) -> list[Connect | Speeds]:
        """Return the messages for a page, with at most the role of its display."""
        order: tuple[Role, ...] = ("viewer", "operator", "admin")
        most = self._roles.get(user_of(display.name), self._roles.get("", "viewer"))
        role = min(page.role, most, key=order.index)
        program = connection == display.program
        who = None
        if page.person:  # no display can name a person of another one
            who = Identity(f"{display.name}/{page.person}", page.page)
        hello = Connect(connection, page.name, role, program, who)
        state: list[Connect | Speeds] = [hello]
        if page.speeds is not None:
            state.append(Speeds(connection, *page.speeds))
        return state

    def _end(self, display: Display) -> list[Disconnect]:
        return [self._drop(display, connection) for connection in list(display.pages)]

    def _drop(self, display: Display, connection: str) -> Disconnect:
        del display.pages[connection]
        self._greeted.discard(connection)
        return Disconnect(connection)


def _changes(
    known: list[Connect | Speeds], state: list[Connect | Speeds]
) -> list[Effect]:
    """Return what the gate gets when the state of a page has changed.

    A new name alone must not connect the page again, as that would end its control.
    """
    was, now = known[0], state[0]
    assert isinstance(was, Connect)
    assert isinstance(now, Connect)
    if replace(was, name=now.name) != now:
        return [*state]
    renamed = [Rename(now.connection, now.name)] if was != now else []
    return [*renamed, *(state[1:] if known[1:] != state[1:] else ())]


def user_of(display: str) -> str:
    """Return the user of the router to whom a display belongs."""
    return display.partition(".")[0]


def _stop_of(sample: bytes) -> tuple[FromPage | FromProgram, Stop] | None:
    """Return a message that is a STOP, and the STOP; this costs little for others."""
    if len(sample) > MOST_COMMAND or b"stop" not in sample:
        return None
    try:
        message = _decode(sample[HEAD_BYTES:])
    except (ValueError, RecursionError):
        return None
    match message:
        case FromPage(text=text):
            stop = stop_in(text)
            return None if stop is None else (message, stop)
        case FromProgram(command=Stop() as stop):
            return message, stop
    return None


def _check_program(display: Display, message: FromProgram) -> None:
    """Check a command of the program of a display.

    Raises:
        WireError: If it is none, or a page could not send its values.

    """
    try:
        if message.connection != display.program:
            raise Refusal(f"it came from {message.connection!r}")
        if not isinstance(message.command, ControlCommand):
            raise Refusal("it needs no control, so it has the form of a page's")
        page = getattr(message.command, "page", message.connection)
        if page not in (*display.pages, display.program):
            raise Refusal(f"it is in the name of {page!r}")
        check(message.command)
    except Refusal as refusal:
        raise WireError(
            f"display {display.name}: got a command of its program: {refusal.why}"
        ) from refusal
