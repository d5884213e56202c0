"""ROS 2 action goals that a client sends and cancels."""

from collections.abc import Callable
from typing import Any

from webmap.sim.rosbridge.dialect import canonical, resolve
from webmap.sim.rosbridge.graph import GoalHandle, GraphError
from webmap.sim.rosbridge.operation import Client, Handlers, Operation, text

_UNKNOWN = 0


class Goals:
    """One client's goals. Their handles are its own: no other can cancel by id."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self._graph = client.graph
        self._handles: dict[tuple[str, Any], GoalHandle] = {}

    @property
    def handlers(self) -> Handlers:
        """What serves each operation."""
        return {"send_action_goal": self._send, "cancel_action_goal": self._cancel}

    def _send(self, operation: Operation) -> None:
        action = text(operation, "action")
        identifier = operation.get("id")
        server = self._graph.actions.get(resolve(action))
        wanted = canonical(text(operation, "action_type"))
        if server is None or server.type != wanted:
            reason = f"Action server {action} of type {wanted} is not available"
            self._finish(action, identifier, _UNKNOWN, reason, ok=False)
            return
        args = operation.get("args", {})
        goal = self._graph.conform(f"{server.type}_Goal", args, finite=True)
        key = (resolve(action), identifier)
        unblock: Callable[[], None] | None = None
        if self._client.encoder.quirks.blocking_goals:
            unblock = self._client.block()
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
            if unblock:
                unblock()

        handle = server.send_goal(goal, on_feedback, on_result)
        if not ended:
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
