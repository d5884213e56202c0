"""Calls of ROS services, on a connection of their own.

A Foxglove server may handle the messages of a client in order, so a slow service delays
all that the client sends after the call. A connection on which a call was not answered
in time gets no further calls.
"""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from webmap.base.errors import ConfigError, ProtocolError, ServiceError
from webmap.ros.foxglove.messages import format_of_part
from webmap.ros.foxglove.protocol import Service
from webmap.ros.foxglove.session import Session

OFFERED_WITHIN = 2.0
"""Longest wait for a service that the server does not offer yet, in seconds."""


class Calls:
    """The calls to one server; the first one opens the connection.

    Args:
        make_session: Makes a connection, which is not opened again.

    """

    def __init__(self, make_session: Callable[[], Session]) -> None:
        self._make_session = make_session
        self._session: Session | None = None
        self._retired: set[Session] = set()

    def session(self) -> Session:
        """Return the connection for the next call; it may not be open yet."""
        session = self._session
        if session is None or session.connection.state == "closed":
            session = self._make_session()
            session.connection.start(asyncio.get_running_loop())
            self._session = session
        return session

    async def call(
        self,
        name: str,
        args: Mapping[str, Any] | Sequence[Any] | None,
        _type: str | None,
        patience: float,
    ) -> Any:
        """Call a service and return the fields of its response.

        The server offers the service with its type, so none has to be given.

        Raises:
            ServiceError: If the server does not offer it, or it fails, or does not
                respond within ``patience`` seconds.
            BridgeClosed: If the connection cannot be opened, or ends before the
                response.

        """
        session = self.session()
        try:
            async with asyncio.timeout(patience):
                return await self._call(session, name, args)
        except TimeoutError:
            await self._retire(session)
            raise ServiceError(f"{name} did not answer within {patience:g} s") from None

    async def service(self, session: Session, name: str) -> Service:
        """Return a service that the server offers, now or within two seconds.

        Raises:
            ServiceError: If it offers no such service.
            BridgeClosed: If the connection cannot be opened, or ends.

        """
        found = await session.wait_for(
            lambda: session.services.get(name), OFFERED_WITHIN
        )
        if found is not None:
            return found
        info = session.info
        why = "it did not introduce itself"
        if info is not None:
            why = f"it offers {len(session.services)} others"
            if "services" not in info.capabilities:
                why = "it offers none: its parameter capabilities lacks services"
        raise ServiceError(f"the bridge offers no service {name}: {why}")

    async def _call(
        self,
        session: Session,
        name: str,
        args: Mapping[str, Any] | Sequence[Any] | None,
    ) -> Any:
        service = await self.service(session, name)
        encodings = (session.info and session.info.supported_encodings) or []
        try:
            request = format_of_part(
                service.request, f"{service.type}_Request", encodings
            )
            data = request.write(args)
            response = format_of_part(
                service.response, f"{service.type}_Response", encodings
            )
        except ConfigError as error:
            raise ServiceError(f"{name} cannot be called: {error}") from None
        try:
            answer = await session.call(service, request.encoding, data)
            return response.read(answer)
        except ServiceError as error:
            raise ServiceError(f"{name} failed: {error}") from None
        except ProtocolError as error:
            raise ServiceError(f"the response of {name} is invalid: {error}") from None

    async def _retire(self, session: Session) -> None:
        """Send no more calls on ``session``; earlier ones may still be answered."""
        if self._session is session:
            self._session = None
        self._retired.add(session)
        for each in [each for each in self._retired if not each.waits]:
            self._retired.discard(each)
            await each.connection.stop()

    async def stop(self) -> None:
        """Close every connection; open calls fail."""
        sessions = [*self._retired, *([self._session] if self._session else [])]
        self._session, self._retired = None, set()
        await asyncio.gather(*(each.connection.stop() for each in sessions))
