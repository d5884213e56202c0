"""All decisions of the gate: events in, actions out. No I/O, and no clock of its own.

The shell calls :meth:`Gate.handle` for each event and :meth:`Gate.step` every 10 ms,
and executes the returned actions in order. It reports the result of a write as another
event before it does anything else; those of zeros that follow each other come after all
of these zeros.
"""

import logging
from collections.abc import Callable
from typing import Any

from webmap.gate import events, protocol
from webmap.gate.actions import Action, SendToDisplay
from webmap.gate.commands import (
    Cancel,
    Refusal,
    Reset,
    Stop,
    begins_like_stop,
    op_of,
    parse,
    robot_in,
)
from webmap.gate.protocol import PROGRAM
from webmap.gate.rules.command_handling import CommandHandler
from webmap.gate.rules.connections import Connection, Connections, Epochs, Ticks
from webmap.gate.rules.health import DisplayPulse
from webmap.gate.rules.machines import Machines

log = logging.getLogger("webmap.gate")


class Gate:
    """The rules for all machines of one display.

    Args:
        ticks: Issues the ticks.
        epochs: Gives the epochs of leases.

    """

    def __init__(
        self, ticks: Ticks | None = None, epochs: Epochs | None = None
    ) -> None:
        self._ticks = ticks or Ticks()
        self._out: list[Action] = []
        self._display_pulse = DisplayPulse()
        self._connections = Connections(self._out.append)
        self._machines = Machines(
            self._display_pulse,
            epochs or Epochs(),
            self._out.append,
            self._connections.refuse,
        )
        self._display_there = False
        self._commands = CommandHandler(
            self._machines, self._connections, self._ticks, self._out.append
        )
        self._handlers: dict[type, Callable[[Any, float], None]] = {
            **self._machines.handlers,
            protocol.Connect: self._connect,
            protocol.Rename: self._rename,
            protocol.Disconnect: self._disconnect,
            protocol.FromPage: self._from_page,
            protocol.FromProgram: self._commands.handle_program,
            protocol.Speeds: self._speeds,
            protocol.Heartbeat: self._heartbeat,
            events.Shutdown: self._shut_down,
        }

    def handle(self, event: protocol.ToGate | events.Event, now: float) -> list[Action]:
        """Process one event; return the actions to execute, in order."""
        self._handlers[type(event)](event, now)
        return self._actions(now)

    def step(self, now: float) -> list[Action]:
        """Do what is due at ``now``; return the actions to execute, in order."""
        if self._display_there and self._display_pulse.fault(now):
            self._display_there = False
            self._end_unsupervised_goals(now)
        self._machines.step(now)
        self._commands.reply_to_takes(now)
        self._connections.count(now)
        tick = self._ticks.issue(now)
        if tick is not None:
            self._out.append(SendToDisplay(protocol.Tick(tick, self._connections.acks)))
        return self._actions(now)

    @property
    def busy(self) -> bool:
        """Whether :meth:`step` has anything to do for any machine."""
        return self._machines.busy

    @property
    def silent(self) -> bool:
        """Whether no machine is driven or being stopped."""
        return self._machines.silent

    def _actions(self, now: float) -> list[Action]:
        self._machines.report(now)
        actions = self._out.copy()
        self._out.clear()
        return actions

    # The display and its pages.

    def _heartbeat(self, message: protocol.Heartbeat, now: float) -> None:
        self._display_pulse.beat(now)
        if not self._display_there:
            self._display_there = True
            self._machines.touch_all()

    def _shut_down(self, event: events.Shutdown, now: float) -> None:
        self._display_pulse.ended = event.why
        for machine in self._machines:
            machine.authority.end(event.why, now)
        self._end_unsupervised_goals(now)

    def _end_unsupervised_goals(self, now: float) -> None:
        """Cancel goals where the robot asks for it: no display supervises them."""
        for machine in self._machines:
            for goals in machine.robots.goals.values():
                goals.lost(now)

    def _connect(self, message: protocol.Connect, now: float) -> None:
        if message.connection != PROGRAM:
            self._disconnect(protocol.Disconnect(message.connection), now)
            self._connections.add(message)

    def _rename(self, message: protocol.Rename, now: float) -> None:
        connection = self._connections.find(message.connection)
        if connection is None or connection.program:
            return
        connection.name = message.name
        for machine in self._machines.which(lambda m: m.involves(connection.id)):
            machine.authority.rename(connection)

    def _disconnect(self, message: protocol.Disconnect, now: float) -> None:
        if message.connection == PROGRAM or not self._connections.remove(
            message.connection
        ):
            return
        for machine in self._machines.which(lambda m: m.involves(message.connection)):
            machine.lost(message.connection, now)

    def _speeds(self, message: protocol.Speeds, now: float) -> None:
        connection = self._connections.find(message.connection)
        if connection is None:
            return
        connection.set_speeds(message.v, message.w)
        holds = self._machines.which(lambda m: m.authority.is_held_by(connection.id))
        for machine in holds:
            machine.authority.set_cap(connection.cap)

    def _from_page(self, message: protocol.FromPage, now: float) -> None:
        connection = self._connections.find(message.connection)
        if connection is None or connection is self._connections.program:
            return
        try:
            command = parse(message.text)
            if isinstance(command, Stop):
                self._machines.check_known(command.robot)
            elif connection.program and not isinstance(command, Reset | Cancel):
                raise Refusal("a program cannot send what needs control as a page does")
        except Refusal as refusal:
            self._refuse_invalid(connection, message.text, refusal.why, now)
        else:
            what = op_of(command)
            self._connections.run_or_refuse(
                connection.id,
                command.robot,
                what,
                lambda: self._commands.handle(connection, command, now),
                now,
            )
        if connection.messages.too_often(now):
            self._connections.close(connection, "too many messages")

    def _refuse_invalid(
        self, connection: Connection, text: bytes, why: str, now: float
    ) -> None:
        what = "command"
        if begins_like_stop(text):  # before the rate limit: STOP comes first (S10)
            stopped = self._commands.stop_malformed(robot_in(text), connection, now)
            what, why = "stop", f"this STOP is not valid ({why}): {stopped}"
        self._connections.refuse(connection.id, None, what, why, now)
        if connection.garbage.too_often(now):
            self._connections.close(connection, "too many invalid messages")
