"""Fields of an operation that a client sent, checked one by one."""

import math
from collections.abc import Callable
from typing import Any, Protocol

from webmap.sim.rosbridge.encode import Encoder
from webmap.sim.rosbridge.graph import Graph, GraphError
from webmap.sim.rosbridge.outbox import Outbox

Operation = dict[str, Any]
Handlers = dict[str, Callable[[Operation], None]]


class Client(Protocol):
    """The session, as the capabilities that serve its operations see it."""

    graph: Graph
    encoder: Encoder
    outbox: Outbox

    def reply(
        self, operation: Operation, identifier: Any = None, fragment_size: Any = None
    ) -> None:
        """Send an operation to the client."""

    def wake(self) -> None:
        """Say that the outbox or a throttled subscription has something."""

    def now(self) -> float:
        """Return monotonic seconds."""

    def spin(self) -> None:
        """Let the whole server hang for good."""

    def block(self) -> Callable[[], None]:
        """Hold the client's next operations back until the result is called."""


def text(operation: Operation, name: str) -> str:
    """Return a field that must be a text.

    Raises:
        GraphError: If it is absent, empty or something else.

    """
    value = operation.get(name)
    if not isinstance(value, str) or not value:
        raise GraphError(f"{name} must be a non-empty string, got {value!r}")
    return value


def whole_number(operation: Operation, name: str) -> int:
    """Return a field that must be a number from 0 up; 0 if it is absent.

    Raises:
        GraphError: If it is something else.

    """
    value = operation.get(name, 0)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value) or value < 0:
        raise GraphError(f"{name} must be a number from 0 up, got {value!r}")
    return int(value)
