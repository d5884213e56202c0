"""Everybody who may say something: the pages' connections and the program. No I/O."""

import logging
from collections.abc import Callable

from webmap.gate.actions import Emit, Say
from webmap.gate.messages import (
    PROGRAM,
    CloseConnection,
    Connect,
    Hello,
    Refused,
)
from webmap.gate.refusal import Refusal
from webmap.gate.rules.connection import Connection

log = logging.getLogger("webmap.gate")


class People:
    """The connections that there are, and what they are told.

    Args:
        emit: Takes the actions.

    """

    def __init__(self, emit: Emit) -> None:
        self.program = Connection(PROGRAM, PROGRAM, "operator")
        self._emit = emit
        self._all = {PROGRAM: self.program}

    @property
    def acks(self) -> dict[str, int]:
        """The newest accepted ``seq`` of each connection."""
        return {connection.id: connection.acked for connection in self._all.values()}

    def find(self, id: str) -> Connection | None:
        """Return the connection of that name, if there is one."""
        return self._all.get(id)

    def add(self, message: Connect) -> None:
        """Take in a page."""
        self._all[message.connection] = Connection(
            message.connection, message.name, message.role
        )
        self._emit(Say(Hello(message.connection)))

    def remove(self, id: str) -> bool:
        """Forget a page; return whether there was one."""
        connection = self._all.pop(id, None)
        if connection is None:
            return False
        self._count(connection, float("inf"))
        return True

    def count(self, now: float) -> None:
        """Tell the display how much was refused; now and then is enough."""
        for connection in self._all.values():
            self._count(connection, now)

    def _count(self, connection: Connection, now: float) -> None:
        count = connection.count_refused(now)
        if count is not None:
            self._emit(Say(count))

    def refuse(
        self, id: str, robot: str | None, what: str, why: str, now: float
    ) -> None:
        """Tell somebody that a command was not taken; not twice in a second."""
        connection = self._all.get(id)
        if connection is None:
            return
        connection.note_refused(what, why)
        if connection.news(robot, what, why, now):
            self._emit(Say(Refused(id, robot, what, why)))

    def attempt(
        self,
        id: str,
        robot: str | None,
        what: str,
        act: Callable[[], object],
        now: float,
    ) -> None:
        """Do what somebody commands; they are told if it is refused."""
        try:
            act()
        except Refusal as refusal:
            self.refuse(id, robot, what, refusal.why, now)

    def close(self, connection: Connection, why: str) -> None:
        """Ask the display to close the page's socket."""
        if not connection.closing:
            connection.closing = True
            log.warning("connection %s is to be closed: %s", connection.id, why)
            self._emit(Say(CloseConnection(connection.id, why)))
