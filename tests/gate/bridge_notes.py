"""The messages that the robot's end of a rosbridge received, for tests."""

from dataclasses import dataclass
from typing import Any


@dataclass
class BridgeMessage:
    at: float
    """When, in seconds of the monotonic clock."""

    link: int
    message: dict[str, Any]

    @property
    def op(self):
        return self.message["op"]

    @property
    def topic(self):
        return self.message.get("topic")


class Noting:
    """Keeps all messages in ``received``."""

    received: list[BridgeMessage]

    def of(self, op, topic=None):
        return [
            t
            for t in self.received
            if t.op == op and (topic is None or t.topic == topic)
        ]
