"""The agent's client of its gate, which displays use too."""

import logging
import time
from collections.abc import Callable, Iterable, Mapping

from webmap.agents.displays import (
    MOST_USERS,
    AllReports,
    Displays,
    Passed,
    ToDisplays,
    Took,
    user_of,
)
from webmap.base.errors import WireError
from webmap.gate import protocol
from webmap.gate.commands import Stop
from webmap.gate.display.client import GateClient
from webmap.gate.protocol import FromGate, FromPage, FromProgram, Role

log = logging.getLogger("webmap.agent")

QUIET = 10.0
"""Seconds for which no other mistake of the same user is logged."""


class AgentGate(GateClient):
    """The gate of an agent: its own client, and the displays.

    Args:
        publish: Sends a sample to all displays, without waiting.
        roles: What the pages of each user may do at most; see :class:`Displays`.

    """

    def __init__(
        self,
        publish: Callable[[bytes], None],
        roles: Mapping[str, Role] | None = None,
    ) -> None:
        super().__init__()
        self.displays = Displays(roles)
        self._publish = publish
        self._complained_at: dict[str, float] = {}
        """When a mistake of each user was logged."""

    def introduction(self) -> list[protocol.ToGate]:
        """Return the first messages for a new gate."""
        return [*super().introduction(), *self.displays.introduction()]

    def take_sample(self, display: str, sample: bytes) -> None:
        """Process a sample of a display, in any thread."""
        now = time.monotonic()
        with self._lock:
            try:
                messages = self.displays.receive(display, sample, now)
            except WireError as error:
                user = user_of(display)
                if now - self._complained_at.get(user, float("-inf")) > QUIET:
                    if len(self._complained_at) > MOST_USERS:
                        self._complained_at.clear()
                    self._complained_at[user] = now
                    log.warning("%s", error)
                return
            self._pass_on(messages)
            if self.displays.wants_reports(now):
                reports, robots = tuple(self._pages.latest), tuple(self._specs)
                self._send_out(AllReports(reports, robots))

    def _pass_on(self, messages: Iterable[Passed]) -> None:
        for message in messages:
            match message:
                case Took() | protocol.Hello():
                    self._send_out(message)
                    continue
                case FromPage():
                    self._keep_stop_of_page(message)
                case FromProgram(command=Stop(robot)):
                    self._keep_stop(None, robot)
            self.send(message)

    def hear(self, message: FromGate) -> None:
        """Process a message from the gate, and pass it on to the displays."""
        super().hear(message)
        with self._lock:
            if isinstance(message, protocol.Tick):
                self._pass_on(self.displays.waiting_stops())
                self._pass_on(self.displays.look(time.monotonic()))
            self._send_out(message)

    def _send_out(self, message: ToDisplays) -> None:
        self._publish(self.displays.send(message, time.monotonic()))
