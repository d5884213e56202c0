"""The agent's client of its gate, which displays use too."""

import logging
import time
from collections.abc import Callable, Mapping

from webmap.agents.displays import AllReports, Displays, ToDisplays, Took
from webmap.base.errors import WireError
from webmap.gate import protocol
from webmap.gate.commands import Stop, begins_like_stop
from webmap.gate.display.client import GateClient
from webmap.gate.protocol import FromGate, FromPage, FromProgram, Role

log = logging.getLogger("webmap.agent")

QUIET = 10.0
"""Seconds for which the same mistake of a display is not logged again."""


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
        self._complained_at = float("-inf")

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
                if now - self._complained_at > QUIET:
                    self._complained_at = now
                    log.warning("%s", error)
                return
            for message in messages:
                if _is_stop(message):
                    session, number = self.displays.newest(display)
                    if isinstance(message, FromPage):
                        self._keep_stop_of_page(message)
                    self._send_out(Took(display, session, number))
                self.send(message)
            unknown = self.displays.unknown(display)
            if unknown is not None:
                self._send_out(unknown)
            if self.displays.wants_reports(now):
                self._send_out(AllReports(tuple(self._pages.latest)))

    def hear(self, message: FromGate) -> None:
        """Process a message from the gate, and pass it on to the displays."""
        super().hear(message)
        with self._lock:
            if isinstance(message, protocol.Tick):
                for ended in self.displays.look(time.monotonic()):
                    self.send(ended)
            self._send_out(message)

    def _send_out(self, message: ToDisplays) -> None:
        self._publish(self.displays.send(message, time.monotonic()))


def _is_stop(message: protocol.ToGate) -> bool:
    match message:
        case FromPage():
            return begins_like_stop(message.text)
        case FromProgram():
            return isinstance(message.command, Stop)
    return False
