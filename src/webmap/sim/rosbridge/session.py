"""One client's side of the protocol, without its socket."""

import logging
from collections import deque
from collections.abc import Callable
from typing import Any

from webmap.sim.rosbridge.encode import Encoder
from webmap.sim.rosbridge.goals import Goals
from webmap.sim.rosbridge.graph import Graph, GraphError
from webmap.sim.rosbridge.incoming import IncomingText
from webmap.sim.rosbridge.operation import Handlers, Operation
from webmap.sim.rosbridge.outbox import Outbox
from webmap.sim.rosbridge.services import Services
from webmap.sim.rosbridge.topics import Topics

log = logging.getLogger("webmap.sim")

_MOST_INPUT = 10_000


class Session:
    """Takes a client's frames, and has the frames that go to it.

    Args:
        graph: The ROS graph that the client sees.
        encoder: Makes the frames; its quirks are the session's.
        clock: Monotonic seconds.
        wake: Called when :meth:`next_frames` may have something.

    """

    def __init__(
        self,
        graph: Graph,
        encoder: Encoder,
        *,
        clock: Callable[[], float],
        wake: Callable[[], None],
    ) -> None:
        self.graph = graph
        self.encoder = encoder
        self.outbox = Outbox()
        self._clock = clock
        self._wake = wake
        self._incoming = IncomingText()
        self._queued: deque[Operation] = deque()
        self._blocked_by: object | None = None
        self._running = False
        self._closed = False
        self.spinning = False
        """Whether the server does nothing else any more because of this client."""
        self._topics = Topics(self)
        self._services = Services(self)
        self._handlers: Handlers = {
            **self._topics.handlers,
            **self._services.handlers,
            **Goals(self).handlers,
            "status": _log_status,
        }

    def receive(self, data: str | bytes) -> None:
        """Take a frame of the client; it never raises, whatever came."""
        operations = self._incoming.feed(data)
        if not operations and not self._incoming.waits:
            self._complain(None, "no JSON object in the frame")
        self._queued.extend(operations)
        self._run_queued()

    def next_frames(self) -> list[str | bytes]:
        """Return the frames of what goes out next; empty when nothing waits."""
        while (entry := self.outbox.pop()) is not None:
            if isinstance(entry, list):
                return list(entry)
            if frames := self._topics.frames(entry):
                return frames
        return []

    def poll(self) -> float | None:
        """Release what throttling held back; return seconds to the next, if any."""
        return self._topics.poll()

    @property
    def overflowed(self) -> bool:
        """Whether so much waits that the client should be let go."""
        return self.outbox.overflowed or len(self._queued) > _MOST_INPUT

    def close(self) -> None:
        """Take everything of this client out of the graph; its goals go on."""
        self._closed = True
        self._topics.close()
        self._services.close()

    def reply(
        self, operation: Operation, identifier: Any = None, fragment_size: Any = None
    ) -> None:
        """Send an operation to the client.

        Args:
            operation: What to send.
            identifier: The id of the request, if it had one.
            fragment_size: What the request asked for; anything but a number is none.

        """
        if self._closed:
            return
        if identifier is not None:
            operation = {**operation, "id": identifier}
        frame = self.encoder.json(operation)
        if isinstance(fragment_size, int) and fragment_size > 0:
            frames = self.encoder.fragments(frame, fragment_size, identifier)
        else:
            frames = [frame]
        self.outbox.reply(frames)
        self._wake()

    def wake(self) -> None:
        """Say that the outbox or a throttled subscription has something."""
        self._wake()

    def now(self) -> float:
        """Return monotonic seconds."""
        return self._clock()

    def spin(self) -> None:
        """Let the whole server hang for good."""
        self.spinning = True

    def block(self) -> Callable[[], None]:
        """Hold the client's next operations back until the result is called."""
        cause = self._blocked_by = object()

        def unblock() -> None:
            if self._blocked_by is cause:
                self._blocked_by = None
                self._run_queued()

        return unblock

    def _run_queued(self) -> None:
        if self._running:
            return  # an operation that ended at once: the loop below goes on
        self._running = True
        while self._queued and self._blocked_by is None and not self._closed:
            self._run(self._queued.popleft())
        self._running = False

    def _run(self, operation: Operation) -> None:
        try:
            self._dispatch(operation)
        except GraphError as error:
            self._complain(operation.get("id"), str(error))
        except Exception:
            log.exception("an operation failed: %.200r", operation)
            self._complain(operation.get("id"), "internal error")

    def _dispatch(self, operation: Operation) -> None:
        if not isinstance(operation.get("id"), str | int | float | None):
            raise GraphError("id must be a text or a number")
        name = operation.get("op")
        handle = self._handlers.get(name) if isinstance(name, str) else None
        if handle is None:
            raise GraphError(f"Unknown operation: {name}")
        handle(operation)

    def _complain(self, identifier: Any, message: str) -> None:
        log.debug("bad request: %s", message)
        if not self.encoder.quirks.silent:
            status = {"op": "status", "level": "error", "msg": message}
            self.reply(status, identifier)


def _log_status(operation: Operation) -> None:
    log.info("status of a client: %.500s", operation.get("msg"))
