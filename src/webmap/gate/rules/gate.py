"""All decisions of the gate: events in, actions out. No I/O, and no clock of its own.

The age is measured between two moments of one clock, this process's own; no clock of
a browser or a robot has a part in it.

The shell calls :meth:`Gate.handle` for whatever happens and :meth:`Gate.step` every
10 ms, and does what they return, in that order. What came of a write it tells with a
further event before it does anything else.
"""

import logging
from collections.abc import Callable
from typing import Any

from webmap.gate import events, protocol
from webmap.gate.actions import Action, Say
from webmap.gate.commands import Refusal, Stop, begins_like_stop, op_of, parse, robot_in
from webmap.gate.protocol import PROGRAM
from webmap.gate.rules.connections import Connection, Epochs, People, Ticks
from webmap.gate.rules.fleet import Fleet
from webmap.gate.rules.health import Pulse
from webmap.gate.rules.orders import Orders, ProgramOrders

log = logging.getLogger("webmap.gate")


class Gate:
    """Decides over every machine of one display.

    Args:
        ticks: The ticks to issue.
        epochs: The epochs to give to leases.

    """

    def __init__(
        self, ticks: Ticks | None = None, epochs: Epochs | None = None
    ) -> None:
        self._ticks = ticks or Ticks()
        self._out: list[Action] = []
        self._pulse = Pulse()
        self._people = People(self._out.append)
        self._fleet = Fleet(
            self._pulse, epochs or Epochs(), self._out.append, self._people.refuse
        )
        self._display_there = False
        self._orders = Orders(self._fleet, self._ticks)
        self._program = ProgramOrders(
            self._fleet, self._people, self._orders, self._out.append
        )
        self._handlers: dict[type, Callable[[Any, float], None]] = {
            **self._fleet.handlers,
            **self._program.handlers,
            protocol.Connect: self._connect,
            protocol.Disconnect: self._disconnect,
            protocol.FromBrowser: self._from_browser,
            protocol.Speeds: self._speeds,
            protocol.Heartbeat: self._beat,
            events.Shutdown: self._shut_down,
        }

    def handle(self, event: protocol.ToGate | events.Event, now: float) -> list[Action]:
        """Take in one event and return what is to be done, in order."""
        self._handlers[type(event)](event, now)
        return self._actions(now)

    def step(self, now: float) -> list[Action]:
        """Let time pass and return what is to be done, in order."""
        if self._display_there and self._pulse.doubt(now):
            self._display_there = False
            self._goals_lost(now)
        self._fleet.step(now)
        self._program.answer_takes(now)
        self._people.count(now)
        tick = self._ticks.issue(now)
        if tick is not None:
            self._out.append(Say(protocol.Tick(tick, self._people.acks)))
        return self._actions(now)

    @property
    def busy(self) -> bool:
        """Whether time may make a difference to some machine."""
        return self._fleet.busy

    @property
    def silent(self) -> bool:
        """Whether no machine is driven or being stopped."""
        return self._fleet.silent

    def _actions(self, now: float) -> list[Action]:
        self._fleet.report(now)
        actions = self._out.copy()
        self._out.clear()
        return actions

    # The display and its pages.

    def _beat(self, message: protocol.Heartbeat, now: float) -> None:
        self._pulse.beat(now)
        if not self._display_there:
            self._display_there = True
            self._fleet.look()

    def _shut_down(self, event: events.Shutdown, now: float) -> None:
        self._pulse.ended = event.why
        for base in self._fleet:
            base.hands.end(event.why, now)
        self._goals_lost(now)

    def _goals_lost(self, now: float) -> None:
        """Nobody is left who could look after a goal."""
        for base in self._fleet:
            for goals in base.robots.goals.values():
                goals.lost(now)

    def _connect(self, message: protocol.Connect, now: float) -> None:
        if message.connection != PROGRAM:
            self._disconnect(protocol.Disconnect(message.connection), now)
            self._people.add(message)

    def _disconnect(self, message: protocol.Disconnect, now: float) -> None:
        if message.connection == PROGRAM or not self._people.remove(message.connection):
            return
        for base in self._fleet:
            base.lost(message.connection, now)

    def _speeds(self, message: protocol.Speeds, now: float) -> None:
        connection = self._people.find(message.connection)
        if connection is None:
            return
        connection.set_speeds(message.v, message.w)
        for base in self._fleet:
            if base.hands.is_held_by(connection.id):
                base.hands.set_cap(connection.cap)

    def _from_browser(self, message: protocol.FromBrowser, now: float) -> None:
        connection = self._people.find(message.connection)
        if connection is None or connection.program:
            return
        try:
            command = parse(message.text)
            if isinstance(command, Stop):
                self._fleet.check_known(command.robot)
        except Refusal as refusal:
            self._take_garbage(connection, message.text, refusal.why, now)
        else:
            what = op_of(command)
            self._people.attempt(
                connection.id,
                command.robot,
                what,
                lambda: self._orders.obey(connection, command, now),
                now,
            )
        if connection.messages.too_often(now):
            self._people.close(connection, "too many messages")

    def _take_garbage(
        self, connection: Connection, text: bytes, why: str, now: float
    ) -> None:
        what = "command"
        if begins_like_stop(text):  # before it is counted: STOP is served first (S10)
            stopped = self._orders.stop_meant(robot_in(text), connection, now)
            what, why = "stop", f"this STOP is not valid ({why}): {stopped}"
        self._people.refuse(connection.id, None, what, why, now)
        if connection.garbage.too_often(now):
            self._people.close(connection, "too many invalid messages")
