"""The display's side of a gate that runs beside a robot.

It exchanges the same messages as with a gate of its own, as numbered samples. It takes
samples and times and returns samples; ``zenoh_link.py`` carries them.
"""

import threading
from collections.abc import Callable

import msgspec

from webmap.agents.displays import Answer
from webmap.agents.samples import Numbering, Order
from webmap.gate import protocol
from webmap.gate.display.supervisor import GateListener
from webmap.gate.protocol import FromGate

LOST = 0.5
"""Seconds without a sample after which the agent counts as lost."""

_decode = msgspec.msgpack.Decoder(FromGate).decode
_encode = msgspec.msgpack.Encoder().encode


class FarGate:
    """The gate of one agent, as a display knows it.

    Args:
        agent: The name of the agent.
        owner: Receives the gate's messages.
        lock: Held while the state changes.
        publish: Sends a sample to the agent, without waiting.

    """

    pid = None
    """The process is on another computer."""

    def __init__(
        self,
        agent: str,
        owner: GateListener,
        lock: "threading.RLock",
        publish: Callable[[bytes], None],
    ) -> None:
        self.agent = agent
        self.ready = False
        """Whether messages of the gate arrive."""
        self.trouble: str | None = f"waiting for the agent {agent}"
        """Why the gate cannot be reached."""
        self._owner = owner
        self._lock = lock
        self._publish = publish
        self._order = Order()
        self._numbering = Numbering()
        self._heard_at = float("-inf")

    def send(self, message: protocol.ToGate) -> None:
        """Send a message to the gate, if it can be reached."""
        with self._lock:
            if self.ready:
                self._put(message)

    def take(self, sample: bytes, now: float) -> None:
        """Process a sample of the agent.

        Raises:
            WireError: If it is not a sample.

        """
        with self._lock:
            body, restarted = self._order.take(sample)
            if body is None:
                return
            message = _decode(body)
            self._heard_at = now
            if restarted and self.ready:
                self._lose(f"the agent {self.agent} has restarted")
            if not self.ready:
                self.ready, self.trouble = True, None
                for each in self._owner.introduction():
                    self._put(each)
                self._owner.hear(protocol.Ready(0))
            if not isinstance(message, protocol.Ready):
                self._owner.hear(message)

    def beat(self, now: float) -> None:
        """Answer the newest sample, and note when the agent is silent; at 20 Hz."""
        with self._lock:
            if self.ready and now - self._heard_at > LOST:
                self._lose(f"no message from the agent {self.agent}")
            if self._order.session is not None:
                self._put(Answer(self._order.session, self._order.newest))

    def _put(self, message: protocol.ToGate | Answer) -> None:
        self._publish(self._numbering.next(_encode(message)))

    def _lose(self, why: str) -> None:
        self.ready, self.trouble = False, why
        self._owner.gone(protocol.GateDown(why))
