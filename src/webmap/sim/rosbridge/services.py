"""Services that a client calls, and services that it answers."""

from collections.abc import Callable
from functools import partial
from itertools import count
from typing import Any

from webmap.sim.rosbridge.dialect import resolve
from webmap.sim.rosbridge.graph import GraphError, Respond
from webmap.sim.rosbridge.operation import Client, Handlers, Operation, text


class Services:
    """One client's calls and the services that it advertised."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self._graph = client.graph
        self._served: set[str] = set()
        self._asked: dict[str, Respond] = {}
        self._numbers = count(1)

    @property
    def handlers(self) -> Handlers:
        """What serves each operation."""
        return {
            "call_service": self._call,
            "advertise_service": self._advertise,
            "unadvertise_service": self._unadvertise,
            "service_response": self._response,
        }

    def close(self) -> None:
        """Take the services out of the graph; calls that wait for them fail."""
        for service in self._served:
            self._graph.unserve(self, service)
        self._served.clear()
        while self._asked:
            _, respond = self._asked.popitem()
            respond("the client that answered the service has gone", ok=False)

    def _call(self, operation: Operation) -> None:
        service = text(operation, "service")
        identifier = operation.get("id")
        size = operation.get("fragment_size")
        blocks = self._client.encoder.quirks.blocking_services
        unblock: Callable[[], None] = self._client.block() if blocks else _nothing

        def respond(values: Any, *, ok: bool = True) -> None:
            response = {
                "op": "service_response",
                "service": service,
                "values": values,
                "result": ok,
            }
            self._client.reply(response, identifier, size)
            unblock()

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
            raise GraphError("a response to a call that nobody waits for")
        respond(operation.get("values", {}), ok=bool(operation.get("result", True)))


def _nothing() -> None:
    """Unblock nothing."""
