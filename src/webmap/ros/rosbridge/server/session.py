"""One client's side of the protocol, without its socket."""

import json
import logging
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import count
from typing import Any

from webmap.ros.rosbridge.server.client import (
    Client,
    Handlers,
    Operation,
    Topics,
    text,
)
from webmap.ros.rosbridge.server.dialect import canonical, resolve
from webmap.ros.rosbridge.server.graph import GoalHandle, GraphError, Respond

log = logging.getLogger("webmap.sim")

_MOST_INPUT = 10_000


@dataclass(eq=False, repr=False)
class Session(Client):
    """Handles a client's frames, and builds the frames for the client."""

    def __post_init__(self) -> None:
        self._incoming = IncomingText()
        self._queued: deque[Operation] = deque()
        self._blocked_by: object | None = None
        self._running = False
        self._closed = False
        self._topics = Topics(self)
        self._services = Services(self)
        self._handlers: Handlers = {
            **self._topics.handlers,
            **self._services.handlers,
            **ClientGoals(self).handlers,
            "status": _log_status,
        }

    def receive(self, data: str | bytes) -> None:
        """Handle a frame of the client; never raises."""
        operations = self._incoming.feed(data)
        if not operations and not self._incoming.waits:
            self._complain(None, "no JSON object in the frame")
        self._queued.extend(operations)
        self._run_queued()

    def next_frames(self) -> list[str | bytes]:
        """Return the next frames to send; empty when nothing waits."""
        while (entry := self.outbox.pop()) is not None:
            if isinstance(entry, list):
                return list(entry)
            if frames := self._topics.frames(entry):
                return frames
        return []

    def poll(self) -> float | None:
        """Do what is due; return the seconds until more is due, if any."""
        waits = (self._topics.poll(), self._services.poll())
        return min((wait for wait in waits if wait is not None), default=None)

    @property
    def overflowed(self) -> bool:
        """Whether so many frames wait that the client must be disconnected."""
        return self.outbox.overflowed or len(self._queued) > _MOST_INPUT

    def close(self) -> None:
        """Remove all of this client from the graph; its goals continue."""
        self._closed = True
        self._topics.close()
        self._services.close()

    def reply(
        self, operation: Operation, identifier: Any = None, fragment_size: Any = None
    ) -> None:
        """Send an operation to the client.

        Args:
            operation: The operation.
            identifier: The id of the request, if it had one.
            fragment_size: The fragment size in the request; ignored if not a number.

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
        self.wake()

    def block(self) -> Callable[[], None]:
        """Hold back the client's operations until the returned function is called."""
        cause = self._blocked_by = object()

        def unblock() -> None:
            if self._blocked_by is cause:
                self._blocked_by = None
                self._run_queued()

        return unblock

    def _run_queued(self) -> None:
        if self._running:
            return  # a nested call: the loop below continues
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


_MOST_KEPT = 64 * 1024
_MOST_FAILURES = 50


class IncomingText:
    """Finds complete JSON objects; an incomplete one is kept, garbage is dropped.

    As in rosbridge, two objects in a frame are both executed, and an object may come in
    pieces. Text that cannot become an object is dropped, after a limited number of
    attempts.
    """

    def __init__(self) -> None:
        self._kept = ""
        # The parser of rosbridge accepts NaN, Infinity and 1e999, and so does json.
        self._decoder = json.JSONDecoder()

    @property
    def waits(self) -> bool:
        """Whether the beginning of an object is kept."""
        return bool(self._kept)

    def feed(self, data: str | bytes) -> list[dict[str, Any]]:
        """Return the operations that are now complete, in order."""
        text = data.decode("utf-8", "replace") if isinstance(data, bytes) else data
        found, rest = self._scan(self._kept + text)
        if not found and self._kept:
            # The new frame may be complete while the kept text is garbage.
            found, rest_alone = self._scan(text)
            rest = rest_alone if found else rest
        self._kept = rest if len(rest) <= _MOST_KEPT else ""
        return found

    def _scan(self, text: str) -> tuple[list[dict[str, Any]], str]:
        found: list[dict[str, Any]] = []
        rest_from: int | None = None
        start = text.find("{")
        failures = 0
        while start >= 0 and failures < _MOST_FAILURES:
            try:
                value, end = self._decoder.raw_decode(text, start)
            except (ValueError, RecursionError):
                failures += 1
                rest_from = start if rest_from is None else rest_from
                start = text.find("{", start + 1)
                continue
            if "op" in value or rest_from is None:
                found.append(value)
                rest_from = None
            start = text.find("{", end)
        return found, "" if rest_from is None else text[rest_from:]


CALL_TIMEOUT = 5.0
"""The default of ``default_call_service_timeout`` in rosbridge_websocket, seconds."""


class Services:
    """One client's calls and the services that it has advertised."""

    def __init__(self, client: Session) -> None:
        self._client = client
        self._graph = client.graph
        self._served: set[str] = set()
        self._asked: dict[str, Respond] = {}
        self._numbers = count(1)
        self._timed: dict[int, tuple[float, Respond]] = {}
        """The calls that fail if they are not answered in time, with that time."""

    @property
    def handlers(self) -> Handlers:
        """The handler of each operation."""
        return {
            "call_service": self._call,
            "advertise_service": self._advertise,
            "unadvertise_service": self._unadvertise,
            "service_response": self._response,
        }

    def close(self) -> None:
        """Remove the services from the graph; calls that wait for them fail."""
        for service in self._served:
            self._graph.unserve(self, service)
        self._served.clear()
        while self._asked:
            _, respond = self._asked.popitem()
            respond("the client that answered the service has gone", ok=False)

    def poll(self) -> float | None:
        """End the calls whose time is over; return seconds to the next one, if any."""
        now = self._client.clock()
        for due, respond in list(self._timed.values()):
            if now >= due:
                respond("Timeout exceeded while waiting for service response", ok=False)
        dues = [due for due, _ in self._timed.values()]
        return min(dues) - now if dues else None

    def _call(self, operation: Operation) -> None:
        service = text(operation, "service")
        identifier = operation.get("id")
        size = operation.get("fragment_size")
        blocks = self._client.encoder.quirks.blocking_services
        unblock: Callable[[], None] = self._client.block() if blocks else _nothing
        number, is_open = next(self._numbers), True

        def respond(values: Any, *, ok: bool = True) -> None:
            nonlocal is_open
            self._timed.pop(number, None)
            if not is_open:
                return  # an answer after the timeout
            is_open = False
            response = {
                "op": "service_response",
                "service": service,
                "values": values,
                "result": ok,
            }
            self._client.reply(response, identifier, size)
            unblock()

        timeout = operation.get("timeout", CALL_TIMEOUT)
        if self._client.encoder.quirks.timed_calls and timeout > 0:
            self._timed[number] = (self._client.clock() + timeout, respond)
            self._client.wake()
        self._graph.call(service, operation.get("args", {}), respond)

    def _advertise(self, operation: Operation) -> None:
        service = resolve(text(operation, "service"))
        ask = partial(self._ask, service)
        self._graph.serve(self, service, text(operation, "type"), ask)
        self._served.add(service)

    def _unadvertise(self, operation: Operation) -> None:
        service = resolve(text(operation, "service"))
        if service not in self._served:
            raise GraphError(f"{service} is not advertised")
        self._served.discard(service)
        self._graph.unserve(self, service)

    def _ask(self, service: str, request: dict[str, Any], respond: Respond) -> None:
        identifier = f"service_request:{service}:{next(self._numbers)}"
        self._asked[identifier] = respond
        call = {"op": "call_service", "id": identifier, "service": service}
        self._client.reply({**call, "args": request})

    def _response(self, operation: Operation) -> None:
        respond = self._asked.pop(text(operation, "id"), None)
        if respond is None:
            raise GraphError("a response to an unknown call")
        respond(operation.get("values", {}), ok=bool(operation.get("result", True)))


def _nothing() -> None:
    """Do nothing: the operation blocks nothing."""


_UNKNOWN = 0


class ClientGoals:
    """One client's goals. Another client cannot cancel them by id."""

    def __init__(self, client: Session) -> None:
        self._client = client
        self._graph = client.graph
        self._handles: dict[tuple[str, Any], GoalHandle] = {}

    @property
    def handlers(self) -> Handlers:
        """The handler of each operation."""
        return {"send_action_goal": self._send, "cancel_action_goal": self._cancel}

    def _send(self, operation: Operation) -> None:
        action = text(operation, "action")
        identifier = operation.get("id")
        server = self._graph.actions.get(resolve(action))
        type_name = canonical(text(operation, "action_type"))
        quirks = self._client.encoder.quirks
        unblock = self._client.block() if quirks.blocking_goals else _nothing

        def refuse(reason: str) -> None:
            if not quirks.unanswered_goals:
                self._finish(action, identifier, _UNKNOWN, reason, ok=False)
                unblock()

        if server is None or server.type != type_name:
            refuse("No action server available")
            return
        args = operation.get("args", {})
        try:
            goal = self._graph.conform(f"{server.type}_Goal", args, finite=True)
        except GraphError:
            unblock()
            raise
        key = (resolve(action), identifier)
        ended = False

        def on_feedback(values: dict[str, Any]) -> None:
            if operation.get("feedback", False):
                feedback = {"op": "action_feedback", "action": action}
                self._client.reply({**feedback, "values": values}, identifier)

        def on_result(status: int, values: dict[str, Any]) -> None:
            nonlocal ended
            ended = True
            self._handles.pop(key, None)
            self._finish(action, identifier, status, values, ok=True)
            unblock()

        handle = server.send_goal(goal, on_feedback, on_result)
        if handle is None:
            refuse("Action goal was rejected")
        elif not ended:
            self._handles[key] = handle

    def _cancel(self, operation: Operation) -> None:
        key = (resolve(text(operation, "action")), operation.get("id"))
        handle = self._handles.get(key)
        if handle is None:
            raise GraphError(f"no goal {key[1]!r} of {key[0]} was sent on this socket")
        handle.cancel()

    def _finish(
        self, action: str, identifier: Any, status: int, values: Any, *, ok: bool
    ) -> None:
        result = {"op": "action_result", "action": action, "values": values}
        self._client.reply({**result, "status": status, "result": ok}, identifier)
