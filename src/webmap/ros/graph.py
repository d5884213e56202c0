"""What rosapi knows of the ROS graph: topics and their types."""

from collections.abc import Awaitable, Callable
from typing import Any

import msgspec

from webmap.errors import BridgeError, ProtocolError, ServiceError
from webmap.ros.decoding import convert

ACTIONS = {"navigate_to_pose": "nav2_msgs/action/NavigateToPose"}
"""Actions by the name that their servers have everywhere: rosapi tells no types."""


class Graph:
    """Questions to a bridge's rosapi; what it knows is remembered for one link.

    Neither ``get_param_names`` nor ``message_details`` is ever asked: on ROS 2 the
    first hangs rosapi for good and the second kills it.

    Args:
        call: Calls a service and returns the fields of its answer.

    """

    def __init__(self, call: Callable[..., Awaitable[Any]]) -> None:
        self._call = call
        self._types: dict[str, str] = {}

    def forget(self) -> None:
        """Remember nothing: the robot may have been started anew."""
        self._types.clear()

    def known(self, topic: str) -> str | None:
        """Return the type of ``topic`` if it was asked before."""
        return self._types.get(topic)

    async def topic_type(self, topic: str) -> str | None:
        """Return the type of ``topic``, or None if nobody knows or answers."""
        if topic in self._types:
            return self._types[topic]
        try:
            answer = await self._call("/rosapi/topic_type", {"topic": topic})
        except BridgeError:
            return None
        found = answer.get("type") if isinstance(answer, dict) else None
        if not isinstance(found, str) or not found:
            return None
        self._types[topic] = found
        return found

    async def published(self, topic: str) -> bool | None:
        """Return whether anybody publishes ``topic``, or None if nobody answers."""
        nodes = await self.publishers(topic)
        return None if nodes is None else bool(nodes)

    async def publishers(self, topic: str) -> list[str] | None:
        """Return the nodes that publish ``topic``, or None if nobody answers."""
        try:
            answer = await self._call("/rosapi/publishers", {"topic": topic})
            nodes: list[str] = convert(answer, _Publishers).publishers
        except (BridgeError, ProtocolError):
            return None
        return nodes

    async def topics(self) -> dict[str, str]:
        """Return the type of every topic.

        Of ROS 2 that is without hidden names, such as those of an action's topics. What
        a known action says of its goals is added, since rosapi does name its server.

        Raises:
            BridgeError: If rosapi does not answer, or answers something else.

        """
        answer = await self._call("/rosapi/topics")
        try:
            names = convert(answer, _Topics)
            found = dict(zip(names.topics, names.types, strict=True))
        except (ProtocolError, ValueError) as error:
            raise ServiceError(f"/rosapi/topics made no sense: {error}") from None
        if any("/msg/" in type for type in found.values()):
            found = {**await self._feedbacks(), **found}
        self._types.update({name: type for name, type in found.items() if type})
        return found

    async def _feedbacks(self) -> dict[str, str]:
        """Return the hidden topics on which known actions say how goals go."""
        try:
            answer = await self._call("/rosapi/action_servers")
            servers = convert(answer, _ActionServers).action_servers
        except (BridgeError, ProtocolError):
            return {}
        known = {name: ACTIONS.get(name.rpartition("/")[2]) for name in servers}
        return {
            f"{server}/_action/feedback": f"{type}_FeedbackMessage"
            for server, type in known.items()
            if type is not None
        }


class _ActionServers(msgspec.Struct):
    action_servers: list[str]


class _Publishers(msgspec.Struct):
    publishers: list[str]


class _Topics(msgspec.Struct):
    topics: list[str]
    types: list[str]
