"""The ROS graph as a Foxglove server offers it: topics, services, types and nodes."""

import asyncio
import time
from typing import Any, Literal

from msgspec import UNSET

from webmap.base.errors import BridgeError, ConfigError, ServiceError
from webmap.ros.definitions import Definitions
from webmap.ros.foxglove.calls import Calls
from webmap.ros.foxglove.messages import (
    Format,
    format_of_channel,
    format_of_part,
)
from webmap.ros.foxglove.protocol import Parameter
from webmap.ros.foxglove.session import Session
from webmap.ros.link import PATIENCE
from webmap.ros.names import same_type

FIRST = 2.0
"""Longest wait for the first channels of a server, in seconds."""


class FoxgloveGraph:
    """What a server offers, and questions to it.

    The open connection for topics answers; without it, that for calls is opened.

    Args:
        main: The connection for topics.
        calls: The connection for calls.

    """

    def __init__(self, main: Session, calls: Calls) -> None:
        self._main = main
        self._calls = calls

    def known(self, topic: str) -> str | None:
        """Return the type of ``topic`` if the server has offered it."""
        return next((each.schema_name for each in self._main.channels_of(topic)), None)

    async def topics(self) -> dict[str, str]:
        """Return the topics that WebMap can read, and the type of each.

        Raises:
            ServiceError: If the server does not introduce itself.
            BridgeClosed: If the connection cannot be opened, or ends.

        """
        session = self._session()
        if await session.wait_for(lambda: session.info, PATIENCE) is None:
            raise ServiceError("the bridge did not introduce itself")
        return await session.wait_for(lambda: session.offered() or None, FIRST) or {}

    async def topic_type(self, topic: str) -> str | None:
        """Return the type of ``topic``, or None if it is not offered."""
        try:
            return self.known(topic) or (await self.topics()).get(topic)
        except BridgeError:
            return None

    async def service_type(self, service: str) -> str | None:
        """Return the type of ``service``, or None if it is not offered."""
        try:
            found = await self._calls.service(self._session(), service)
        except BridgeError:
            return None
        return found.type or None

    async def nodes(
        self, kind: Literal["publishers", "subscribers"], topic: str
    ) -> list[str] | None:
        """Return the nodes of a kind of a topic, or None if the server named none.

        Bridges of version 3 name nodes only when one of them has come or gone.
        """
        nodes = (
            self._main.publishers if kind == "publishers" else self._main.subscribers
        )
        return nodes.get(topic)

    async def definitions(self, type: str, kind: str) -> Definitions:
        """Return the definitions of a type and of all its parts, and the included ones.

        Args:
            type: The type.
            kind: ``"msg"``, or ``"srv"`` for the request of a service.

        Raises:
            ServiceError: If the server has offered no topic or service of the type.
            BridgeClosed: If the connection cannot be opened, or ends.

        """
        session = self._session()

        def look() -> Format | None:
            if kind == "msg":
                channel = session.channel_with(type)
                return None if channel is None else format_of_channel(channel)
            encodings = (session.info and session.info.supported_encodings) or []
            for service in session.services.values():
                if same_type(service.type, type) and service.request is not None:
                    return format_of_part(service.request, type, encodings)
            return None

        try:
            found = await session.wait_for(look, FIRST)
            if found is not None:
                return found.definitions
            why = f"the bridge offers nothing of type {type}"
        except ConfigError as error:
            why = f"the bridge's schema of {type} cannot be read: {error}"
        raise ServiceError(why)

    async def time(self) -> float | None:
        """Return the time of the ROS system in seconds; None until a message came.

        Each message has the time of the server; half of a ping is added for its way.
        """
        if self._main.time is None:
            return None
        stamp, came = self._main.time
        return stamp / 1e9 + time.monotonic() - came + self._main.connection.lag / 2

    async def set_parameter(self, name: str, value: Any, patience: float) -> Any:
        """Set a parameter and return its new value.

        Raises:
            ServiceError: If the server does not answer in time, or sets none.
            BridgeClosed: If the connection cannot be opened, or ends.

        """
        session = self._calls.session()
        try:
            async with asyncio.timeout(patience):
                info = await session.wait_for(lambda: session.info, patience)
                if info is not None and "parameters" not in info.capabilities:
                    raise ServiceError(
                        f"{name} cannot be set: the parameter capabilities of the "
                        "bridge lacks parameters"
                    )
                kind = "float64" if isinstance(value, float) else None
                answer = await session.set_parameters([Parameter(name, value, kind)])
        except TimeoutError:
            raise ServiceError(f"{name} was not set within {patience:g} s") from None
        for parameter in answer.parameters:
            if parameter.name == name and parameter.value is not UNSET:
                return parameter.value
        raise ServiceError(f"{name} cannot be set: the bridge returned no value of it")

    def _session(self) -> Session:
        main = self._main
        is_open = main.connection.state == "open" and main.info is not None
        return main if is_open else self._calls.session()
