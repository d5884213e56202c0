"""The fields of a client's operation, and the frames that wait to be sent."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from webmap.ros.rosbridge.server.encode import Encoder, Publication
from webmap.ros.rosbridge.server.graph import Graph, GraphError

Operation = dict[str, Any]
Handlers = dict[str, Callable[[Operation], None]]


def text(operation: Operation, name: str) -> str:
    """Return a field that must be a string.

    Raises:
        GraphError: If the field is absent, empty or not a string.

    """
    value = operation.get(name)
    if not isinstance(value, str) or not value:
        raise GraphError(f"{name} must be a non-empty string, got {value!r}")
    return value


def whole_number(operation: Operation, name: str) -> int:
    """Return a field that must be a number of at least 0; 0 if absent.

    Raises:
        GraphError: If the field is not such a number.

    """
    value = operation.get(name, 0)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value) or value < 0:
        raise GraphError(f"{name} must be a number from 0 up, got {value!r}")
    return int(value)


DEFAULT_DEPTH = 100
"""Publications of a topic that may wait if the client stated no queue length."""

MOST_REPLIES = 10_000
"""Replies that may wait; a client with more is disconnected."""


class Outbox:
    """Frames to send, in order; each topic keeps only its newest ones."""

    def __init__(self) -> None:
        self._order: deque[str | list[str]] = deque()
        self._topics: dict[str, deque[Publication]] = {}
        self._replies = 0
        self.dropped = 0
        """Publications that were replaced by newer ones of their topic."""

    def __len__(self) -> int:
        return len(self._order)

    @property
    def overflowed(self) -> bool:
        """Whether more replies wait than a client that reads would have."""
        return self._replies > MOST_REPLIES

    def reply(self, frames: list[str]) -> None:
        """Append a reply, in one frame or in fragments; it is never dropped."""
        self._replies += 1
        self._order.append(frames)

    def publication(self, publication: Publication, depth: int) -> None:
        """Append a publication; above ``depth`` the oldest of the topic is dropped."""
        waiting = self._topics.setdefault(publication.topic, deque())
        waiting.append(publication)
        self._order.append(publication.topic)
        while len(waiting) > max(depth, 1):
            waiting.popleft()
            # The order has one entry for each waiting publication; keep the oldest
            # entry.
            self._order.pop()
            self.dropped += 1

    def pop(self) -> list[str] | Publication | None:
        """Return the next reply's frames or publication to send."""
        while self._order:
            entry = self._order.popleft()
            if not isinstance(entry, str):
                self._replies -= 1
                return entry
            waiting = self._topics.get(entry)
            if waiting:
                return waiting.popleft()
        return None

    def forget(self, topic: str) -> None:
        """Drop the waiting publications of a topic that the client unsubscribed."""
        if self._topics.pop(topic, None):
            self._order = deque(entry for entry in self._order if entry != topic)


@dataclass(eq=False, repr=False)
class Client:
    """One client of the server: its graph, and its outgoing frames."""

    graph: Graph
    """The ROS graph that the client sees."""

    encoder: Encoder
    """Builds the frames; its quirks are those of the client's server."""

    clock: Callable[[], float]
    """Returns monotonic seconds."""

    wake: Callable[[], None]
    """Called when the outbox or a throttled subscription has a frame to send."""

    outbox: Outbox = field(default_factory=Outbox, init=False)
    spinning: bool = field(default=False, init=False)
    """Whether the whole server hangs because of this client."""
