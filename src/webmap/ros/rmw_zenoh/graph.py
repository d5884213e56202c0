"""The ROS graph of rmw_zenoh: what the liveliness tokens of its nodes announce.

A token is a key, such as ``@ros2_lv/0/ID/0/10/MP/%/%/robot/%odom/TYPE/HASH/QOS`` for a
publisher of ``/odom``; ``docs/design.md`` of rmw_zenoh describes its parts.
"""

import re
import time
from collections.abc import Awaitable, Callable, Iterable
from contextlib import suppress
from typing import Any, Literal, NamedTuple

from webmap.base.errors import BridgeError, ProtocolError, ServiceError
from webmap.base.text import one_line
from webmap.ros.definitions import Definitions, shipped
from webmap.ros.names import is_topic, normalise_topic

ROOT = "@ros2_lv"
"""The first part of each token."""

MOST_ENDPOINTS = 20_000
"""Most publishers, subscribers and services of one graph; others are left out."""

_NODE = "NN"
_KINDS = {"MP": "publishers", "MS": "subscribers", "SS": "services", "SC": "clients"}
_PARTS = 13
"""Parts of the token of a publisher, or of another endpoint."""

_LATCHED = "1"
"""Transient local, in the second part of a token's quality of service."""

_TYPE = re.compile(r"([A-Za-z]\w*)::(msg|srv|action)::dds_::([A-Za-z]\w*)_", re.ASCII)


class Endpoint(NamedTuple):
    """A publisher, a subscriber or a service of one node."""

    kind: str
    """``publishers``, ``subscribers``, ``services`` or ``clients``."""

    node: str
    name: str
    """The topic or the service."""

    type: str
    """The name of the type: ``nav_msgs/msg/Odometry``."""

    hash: str
    """The hash of the type's definition."""

    latched: bool
    """Whether the publisher keeps its last messages for late subscribers."""

    key: str
    """The part of the key of its messages after the domain."""


def read_token(token: str) -> Endpoint | None:
    """Return what a token announces; None for a node.

    Raises:
        ProtocolError: If the text is not a token of rmw_zenoh.

    """
    parts = token.split("/")
    kind = parts[5] if len(parts) > 5 else ""
    if parts[0] == ROOT and kind == _NODE:
        return None
    if parts[0] == ROOT and kind in _KINDS and len(parts) >= _PARTS:
        space, node, name, type, hash, quality = parts[7:_PARTS]
        name, match = name.replace("%", "/"), _TYPE.fullmatch(type)
        if match is not None and is_topic(name) and name == normalise_topic(name):
            return Endpoint(
                _KINDS[kind],
                f"{space.replace('%', '/').rstrip('/')}/{node.replace('%', '/')}",
                name,
                "/".join(match.groups()),
                hash,
                quality.split(":")[1:2] == [_LATCHED],
                f"{name.strip('/')}/{type}/{hash}",
            )
    raise ProtocolError(
        f"got the token {one_line(token, 300)}, which no rmw_zenoh makes"
    )


class RmwZenohGraph:
    """The topics and services of one domain.

    Args:
        url: The bridge's address.
        ask: Asks the router for the tokens of the domain.

    """

    def __init__(self, url: str, ask: Callable[[], Awaitable[Iterable[str]]]) -> None:
        self._url = url
        self._ask = ask
        self._all: dict[str, Endpoint] = {}
        self._named: dict[tuple[str, str], dict[str, Endpoint]] = {}
        self.stamp: tuple[int, float] | None = None
        """When the newest message was published, in nanoseconds, and when it came."""

    def add(self, token: str) -> str | None:
        """Add what a token announces; return the topic whose publishers have changed.

        Raises:
            ProtocolError: If the text is not a token, or there are too many.

        """
        endpoint = read_token(token)
        if endpoint is None or token in self._all:
            return None
        if len(self._all) >= MOST_ENDPOINTS:
            raise ProtocolError(
                f"got more than {MOST_ENDPOINTS} publishers, subscribers and services; "
                "the others are left out"
            )
        self._all[token] = endpoint
        self._named.setdefault((endpoint.kind, endpoint.name), {})[token] = endpoint
        return endpoint.name if endpoint.kind == "publishers" else None

    def remove(self, token: str) -> None:
        """Forget what a token announced."""
        endpoint = self._all.pop(token, None)
        if endpoint is not None:
            which = (endpoint.kind, endpoint.name)
            del self._named[which][token]
            if not self._named[which]:
                del self._named[which]

    def clear(self) -> None:
        """Forget everything: the connection has ended."""
        self._all.clear()
        self._named.clear()
        self.stamp = None

    def endpoints(self, kind: str, name: str) -> list[Endpoint]:
        """Return the endpoints of a kind of a topic or a service."""
        return list(self._named.get((kind, name), {}).values())

    def known(self, topic: str) -> str | None:
        """Return the type of ``topic`` if a node has announced it."""
        every = (
            *self.endpoints("publishers", topic),
            *self.endpoints("subscribers", topic),
        )
        return every[0].type if every else None

    async def topics(self) -> dict[str, str]:
        """Return the topics and the type of each, asked now.

        Raises:
            BridgeClosed: If the router cannot be reached.

        """
        now = await self._now()
        return {name: type for _, name in now._named if (type := now.known(name))}

    async def _now(self) -> "RmwZenohGraph":
        """Return the graph as the router knows it; tokens may be on their way here."""
        now = RmwZenohGraph(self._url, self._ask)
        for token in await self._ask():
            with suppress(ProtocolError):  # the open connection reports it
                now.add(token)
        return now

    async def topic_type(self, topic: str) -> str | None:
        """Return the type of ``topic``, or None if no node has announced it."""
        try:
            return self.known(topic) or (await self.topics()).get(topic)
        except BridgeError:
            return None

    async def service_type(self, service: str) -> str | None:
        """Return the type of ``service``, or None if no node has announced it."""
        return next((e.type for e in self.endpoints("services", service)), None)

    async def nodes(
        self, kind: Literal["publishers", "subscribers"], topic: str
    ) -> list[str] | None:
        """Return the nodes of a kind of a topic; None if the router does not answer."""
        try:
            found = (await self._now()).endpoints(kind, topic)
        except BridgeError:
            return None
        return sorted({each.node for each in found})

    async def definitions(self, type: str, kind: str) -> Definitions:
        """Return the definitions that are included in WebMap; nodes send none."""
        return shipped(ros2=True)

    async def time(self) -> float | None:
        """Return the time of the robot in seconds; None until a message came."""
        if self.stamp is None:
            return None
        stamp, came = self.stamp
        return stamp / 1e9 + time.monotonic() - came

    async def set_parameter(self, name: str, value: Any, patience: float) -> Any:
        """Raise ServiceError: WebMap sends nothing to this robot."""
        raise ServiceError(f"{name} cannot be set: WebMap only reads {self._url}")
