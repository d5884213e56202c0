"""What a robot's end of a rosbridge was told, as tests ask for it."""

from dataclasses import dataclass
from typing import Any


@dataclass
class Told:
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
    """Has noted all that it was told, in ``told``."""

    told: list[Told]

    def of(self, op, topic=None):
        return [
            t for t in self.told if t.op == op and (topic is None or t.topic == topic)
        ]
