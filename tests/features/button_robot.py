"""A node of a robot behind a rosbridge, which answers services and receives topics."""

import contextlib
import json
import threading
from collections.abc import Callable, Iterator
from typing import Any

from websockets.sync.client import ClientConnection, connect

Answer = Callable[[dict], dict | None]


class RobotNode:
    """Answers service calls, and records the calls and messages that it receives.

    Args:
        link: The connection to the rosbridge.
        services: For each name the type and a function that returns the response;
            None sends no response.
        topics: The type of each subscribed topic.

    """

    def __init__(
        self,
        link: ClientConnection,
        services: dict[str, tuple[str, Answer]],
        topics: dict[str, str],
    ) -> None:
        self.calls: list[tuple[str, dict]] = []
        self.received: list[tuple[str, Any]] = []
        self._answers = {name: answer for name, (_, answer) in services.items()}
        self._link = link
        for name, (type, _) in services.items():
            self._send(op="advertise_service", service=name, type=type)
        for name, type in topics.items():
            self._send(op="subscribe", id=f"s{name}", topic=name, type=type)
        # The bridge has processed the earlier requests when this response arrives.
        self._send(op="call_service", id="ready", service="/rosapi/get_time")
        while json.loads(self._link.recv(10)).get("id") != "ready":
            pass
        self._thread = threading.Thread(target=self._live, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._link.close()
        self._thread.join(5)

    def _send(self, **op: Any) -> None:
        self._link.send(json.dumps(op))

    def _live(self) -> None:
        for frame in self._link:
            op = json.loads(frame)
            if op["op"] == "publish":
                self.received.append((op["topic"], op["msg"]))
            elif op["op"] == "call_service":
                self._answer(op)

    def _answer(self, op: dict) -> None:
        service = op["service"]
        self.calls.append((service, op["args"]))
        values = self._answers[service](op["args"])
        if values is not None:
            self._send(
                op="service_response",
                id=op["id"],
                service=service,
                values=values,
                result=True,
            )


@contextlib.contextmanager
def robot_node(
    url: str, services: dict[str, tuple[str, Answer]], topics: dict[str, str]
) -> Iterator[RobotNode]:
    with connect(url) as link:
        node = RobotNode(link, services, topics)
        try:
            yield node
        finally:
            node.close()
