"""One client's subscription to one topic, however many times it asked."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from webmap.sim.rosbridge.encode import Publication


@dataclass(frozen=True, slots=True)
class Request:
    """What one ``op: subscribe`` asked for."""

    throttle: float = 0.0
    """The least time between two messages, in seconds."""
    queue_length: int = 0
    fragment_size: int | None = None
    compression: str = "none"


class Subscription:
    """All requests of a client for a topic, merged into one copy of each message."""

    def __init__(self, send: Callable[[Publication, int], None]) -> None:
        self._send = send
        self._requests: dict[str | None, Request] = {}
        self._waiting: deque[Publication] = deque()
        self._sent_at = float("-inf")
        self.merged = Request()
        self._got_any = False

    def ask(self, identifier: str | None, request: Request) -> bool:
        """Add a request; return whether its id is new."""
        is_new = identifier not in self._requests
        self._requests[identifier] = request
        self._merge()
        return is_new

    def drop(self, identifier: str | None) -> bool:
        """Take a request away, all for None; return whether none is left."""
        if identifier is None:
            self._requests.clear()
        else:
            self._requests.pop(identifier, None)
        if self._requests:
            self._merge()
        return not self._requests

    def _merge(self) -> None:
        # As rosbridge does: the lowest of each, and the densest compression.
        requests = self._requests.values()
        sizes = [r.fragment_size for r in requests if r.fragment_size is not None]
        asked = {r.compression for r in requests}
        dense = [c for c in ("cbor-raw", "cbor", "png") if c in asked]
        self.merged = Request(
            min(r.throttle for r in requests),
            min(r.queue_length for r in requests),
            min(sizes, default=None),
            dense[0] if dense else "none",
        )

    def offer(self, publication: Publication, now: float) -> None:
        """Send a message on, keep it until its time comes, or drop it."""
        self._got_any = True
        depth = self.merged.queue_length
        if now >= self.due and not self._waiting:
            self._pass_on(publication, now)
        elif depth > 0:
            self._waiting.append(publication)
            while len(self._waiting) > depth:
                self._waiting.popleft()

    @property
    def spins(self) -> bool:
        """Whether a rosbridge 2.1.0 may hang when this subscription ends."""
        return (
            self._got_any and self.merged.throttle == 0 and self.merged.queue_length > 0
        )

    @property
    def due(self) -> float:
        """When the next message may go, on the clock of ``offer``."""
        return self._sent_at + self.merged.throttle

    @property
    def next_due(self) -> float | None:
        """When a message that waits may go; None if none waits."""
        return self.due if self._waiting else None

    def poll(self, now: float) -> None:
        """Send what waited long enough."""
        while self._waiting and now >= self.due:
            self._pass_on(self._waiting.popleft(), now)

    def _pass_on(self, publication: Publication, now: float) -> None:
        self._sent_at = now
        self._send(publication, self.merged.queue_length)
