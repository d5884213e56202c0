"""Connections, their roles, leases, ticks and refusals. No I/O."""

import logging
import secrets
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from webmap.base.roles import Role
from webmap.base.text import isolated
from webmap.gate.actions import Emit, SendToDisplay
from webmap.gate.commands import Refusal
from webmap.gate.protocol import (
    PROGRAM,
    CloseConnection,
    Connect,
    Hello,
    Identity,
    Refused,
    RefusedCount,
)
from webmap.gate.specs import page_cap

PERIOD = 0.05
"""Seconds between two ticks."""

MAX_AGE = 0.3
"""The oldest tick that a command may echo, in seconds (S2)."""

_REMEMBERED = 64


class Ticks:
    """Issues ticks and knows the age of the newest ones.

    An age is the time between two moments on the clock of this process; no clock of a
    browser or a robot is involved.

    Args:
        first: The first number. It is random by default, so that ticks of another
            session of the gate are unknown here.

    """

    def __init__(self, first: int | None = None) -> None:
        self.newest = (secrets.randbits(32) if first is None else first) - 1
        self._issued: deque[float] = deque(maxlen=_REMEMBERED)
        self._due = float("-inf")

    def issue(self, now: float) -> int | None:
        """Return a new tick if one is due at ``now``."""
        if now < self._due:
            return None
        # If a tick is late by more than one period, the process was suspended; missed
        # ticks are not made up for.
        self._due = self._due + PERIOD if now < self._due + PERIOD else now + PERIOD
        self.newest += 1
        self._issued.append(now)
        return self.newest

    def age(self, tick: int, now: float) -> float | None:
        """Return the seconds since ``tick`` was issued; ``None`` if it is unknown."""
        back = self.newest - tick
        if not 0 <= back < len(self._issued):
            return None
        return now - self._issued[-1 - back]

    def check(self, tick: int, now: float) -> float:
        """Check that the tick that a command echoes is recent enough (S2).

        Returns:
            The tick's age in seconds.

        Raises:
            Refusal: If the tick is too old or was never issued here.

        """
        age = self.age(tick, now)
        if age is None:
            raise Refusal("command too old, or from before a gate restart: ignored")
        if age > MAX_AGE:
            raise Refusal(f"command too old (over {MAX_AGE * 1000:.0f} ms): ignored")
        return age


@dataclass(frozen=True, slots=True)
class Lease:
    """The right of one connection to move one machine."""

    connection: str
    name: str
    """The name of the holder, for people."""
    epoch: int
    program: bool = False
    """Whether a program is the holder; any operator may take control from it."""
    identity: Identity | None = None

    @property
    def called(self) -> str:
        """The holder in a sentence for people."""
        return isolated(self.name or self.connection)


class Epochs:
    """Numbers for leases, each larger than the one before.

    They start at a random number, so that the epoch of a command of an earlier session
    of the gate never equals that of a lease of this session.
    """

    def __init__(self, first: int | None = None) -> None:
        self._next = secrets.randbits(31) if first is None else first

    def next(self) -> int:
        """Return the epoch of a new lease."""
        self._next += 1
        return self._next


def check_take(
    lease: Lease | None, role: Literal["viewer", "operator", "admin"], program: bool
) -> None:
    """Check that a connection without the lease of a machine may take control of it.

    Args:
        lease: The current lease, of another connection, if there is one.
        role: The role of the connection that takes control.
        program: Whether this connection is a program.

    Raises:
        Refusal: If it may not take control.

    """
    check_role(role)
    if lease is None or (lease.program and not program):
        return
    raise Refusal(f"{lease.called} has control")


def check_lease(lease: Lease | None, connection: str, epoch: int) -> None:
    """Check that a command comes from the holder and has the epoch of the lease.

    Raises:
        Refusal: If the connection is not the holder, or the epoch is a different one.

    """
    if lease is None:
        raise Refusal("no operator has control: take control first")
    if lease.connection != connection:
        raise Refusal(f"{lease.called} has control")
    if lease.epoch != epoch:
        raise Refusal(
            f"control of the robot changed: got epoch {epoch}, expected {lease.epoch}"
        )


def check_role(role: Literal["viewer", "operator", "admin"]) -> None:
    """Check that the role is that of an operator or an administrator.

    Raises:
        Refusal: If ``role`` is that of a viewer.

    """
    if role == "viewer":
        raise Refusal("viewers can only look and press STOP; driving needs an operator")


GARBAGE_LIMIT = 20
"""Invalid messages in a second at which a connection is closed (S10)."""

FLOOD_LIMIT = 400
"""Messages in a second at which a connection is closed.

A page that was offline for some seconds may rightly deliver a few hundred at once.
"""

COUNT_EVERY = 1.0
"""Seconds between two reports of how many messages were refused."""

QUIET = 1.0
"""Seconds for which the same refusal is not sent again."""


class RateLimit:
    """Counts the events of the last second.

    Args:
        limit: The count that is too high.

    """

    def __init__(self, limit: int) -> None:
        self._times: deque[float] = deque(maxlen=limit)

    def too_often(self, now: float) -> bool:
        """Count an event at ``now``; return whether the limit is reached."""
        times = self._times
        times.append(now)
        return len(times) == times.maxlen and now - times[0] < 1.0


class Connection:
    """One connection: its role, its limits, and what it sent.

    Args:
        id: The display's name for the connection.
        name: Its name for people.
        role: Its role.
        program: Whether it is a program, the Python code of a display.
        identity: That of the person at the page.

    """

    def __init__(
        self,
        id: str,
        name: str,
        role: Role,
        *,
        program: bool = False,
        identity: Identity | None = None,
    ) -> None:
        self.id = id
        self.name = name
        self.role = role
        self.program = program
        self.identity = identity
        self.acked = -1
        """The newest accepted ``seq``."""
        self.cap = page_cap()
        self.garbage = RateLimit(GARBAGE_LIMIT)
        self.messages = RateLimit(FLOOD_LIMIT)
        self.closing = False
        self.flagged = False
        """Whether the log already has that this page asks for more than full speed."""
        self._refused = 0
        self._last_refused = ""
        self._counted_at = float("-inf")
        self._sent_at: dict[tuple[str | None, str, str], float] = {}

    @property
    def called(self) -> str:
        """The connection in a sentence for people."""
        return isolated(self.name or self.id)

    def set_speeds(self, v: float, w: float) -> None:
        """Set the limits of the page's ``Teleop``; invalid ones mean speed 0."""
        self.cap = page_cap(v, w)

    def note_refused(self, what: str, why: str) -> None:
        """Count a refused message, for :meth:`count_refused`."""
        self._refused += 1
        self._last_refused = f"{what}: {why}"

    def count_refused(self, now: float) -> RefusedCount | None:
        """Return the number of refusals since the last count, if it is due and not 0.

        Args:
            now: Seconds, monotonic; infinity for the last count.

        """
        if not self._refused or now - self._counted_at < COUNT_EVERY:
            return None
        count = RefusedCount(self.name, self._refused, self._last_refused)
        self._refused, self._counted_at = 0, now
        return count

    def is_new_refusal(
        self, robot: str | None, what: str, why: str, now: float
    ) -> bool:
        """Return whether this refusal was not sent within the last second."""
        recent = {key: at for key, at in self._sent_at.items() if now - at < QUIET}
        self._sent_at = recent
        key = (robot, what, why)
        if key in recent:
            return False
        recent[key] = now
        return True


log = logging.getLogger("webmap.gate")


class Connections:
    """All connections, and the refusals that are sent to them.

    Args:
        emit: Called with each action.

    """

    def __init__(self, emit: Emit) -> None:
        self.program = Connection(PROGRAM, PROGRAM, "operator", program=True)
        """The Python code of the gate's own display."""
        self._emit = emit
        self._all = {PROGRAM: self.program}

    @property
    def acks(self) -> dict[str, int]:
        """The newest accepted ``seq`` of each connection."""
        return {connection.id: connection.acked for connection in self._all.values()}

    def find(self, id: str) -> Connection | None:
        """Return the connection with this id, if there is one."""
        return self._all.get(id)

    def add(self, message: Connect) -> None:
        """Add the connection of a page, or of a program of another display."""
        self._all[message.connection] = Connection(
            message.connection,
            message.name,
            message.role,
            program=message.program,
            identity=message.identity,
        )
        self._emit(SendToDisplay(Hello(message.connection)))

    def remove(self, id: str) -> bool:
        """Remove such a connection; return whether there was one."""
        connection = self._all.pop(id, None)
        if connection is None:
            return False
        self._count(connection, float("inf"))
        return True

    def count(self, now: float) -> None:
        """Send the display the counts of refused messages that are due."""
        for connection in self._all.values():
            self._count(connection, now)

    def _count(self, connection: Connection, now: float) -> None:
        count = connection.count_refused(now)
        if count is not None:
            self._emit(SendToDisplay(count))

    def refuse(
        self, id: str, robot: str | None, what: str, why: str, now: float
    ) -> None:
        """Send a refusal to a connection, the same one at most once in a second."""
        connection = self._all.get(id)
        if connection is None:
            return
        connection.note_refused(what, why)
        if connection.is_new_refusal(robot, what, why, now):
            self._emit(SendToDisplay(Refused(id, robot, what, why)))

    def run_or_refuse(
        self,
        id: str,
        robot: str | None,
        what: str,
        act: Callable[[], object],
        now: float,
    ) -> None:
        """Execute a command; if it is refused, send the refusal to the connection."""
        try:
            act()
        except Refusal as refusal:
            self.refuse(id, robot, what, refusal.why, now)

    def close(self, connection: Connection, why: str) -> None:
        """Ask the display to close the page's socket."""
        if not connection.closing:
            connection.closing = True
            log.warning("connection %s is to be closed: %s", connection.id, why)
            self._emit(SendToDisplay(CloseConnection(connection.id, why)))
