"""The accepted connections of the server, and how long they may stay open.

uvicorn has no time limit for the headers of a request, and counts all connections
alike. Here each connection waits in a bounded group until a request on it comes from a
person who has signed in, and again after that request was answered.
"""

import asyncio
import contextlib
import ipaddress
import logging
from collections.abc import Iterator
from typing import Any, Generic, TypeVar, cast

from starlette.types import Scope
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import (
    WebSocketsSansIOProtocol,
)

from webmap.server.origins import ip_of

log = logging.getLogger("webmap.server")

WAITING_S = 10.0
"""How long a connection may go without a request from a person who has signed in, in
seconds."""

STRANGERS = 256
STRANGERS_PER_ADDRESS = 64
SIGNED_IN = 256
"""The greatest numbers of waiting connections: those without a sign-in yet, and those
between two requests of people who have signed in. Neither can displace the other."""

_LOG_EVERY_S = 60.0
_FLUSH_S = 1.0
_KEY = "webmap.connection"

T = TypeVar("T")


class Waiting(Generic[T]):
    """Waiting connections up to a limit; the newest ones stay.

    A new connection is never refused: whether it has signed in is known only when its
    request arrives. Instead, the oldest connection of the address with the most is
    closed, so that one address cannot displace the connections of another.

    Args:
        limit: The greatest number of waiting connections.
        per_address: The greatest number for one address. It does not apply to this
            machine's own: a reverse proxy or a tunnel here brings many people.

    """

    def __init__(self, limit: int, per_address: int) -> None:
        self._limit = limit
        self._per_address = per_address
        # The oldest first; a dict keeps the order and finds each one quickly.
        self._by_address: dict[str, dict[T, None]] = {}
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def add(self, connection: T, address: str) -> T | None:
        """Add a waiting connection.

        Args:
            connection: A connection that is not waiting yet.
            address: Its origin, from :func:`origin_of`.

        Returns:
            A connection that was removed for it and must be closed, or None.

        """
        mine = self._by_address.setdefault(address, {})
        gone = None
        if address and len(mine) >= self._per_address:
            gone = self._oldest(address)
        elif self._count >= self._limit:
            gone = self._oldest(max(self._by_address, key=self._number_of))
        self._by_address.setdefault(address, {})[connection] = None
        self._count += 1
        return gone

    def remove(self, connection: T, address: str) -> None:
        """Remove a connection, because it is served or has ended."""
        mine = self._by_address[address]
        del mine[connection]
        self._count -= 1
        if not mine:
            del self._by_address[address]

    def _oldest(self, address: str) -> T:
        connection = next(iter(self._by_address[address]))
        self.remove(connection, address)
        return connection

    def _number_of(self, address: str) -> int:
        return len(self._by_address[address])


def origin_of(address: str) -> str:
    """Return the part of an address that is counted: for IPv6 a network of 64 bits.

    Returns:
        Empty for this machine itself, and if it is no IP address, such as the path of a
        Unix socket.

    """
    ip = ip_of(address)
    if ip is None or ip.is_loopback:
        return ""
    if ip.version == 6:
        return str(ipaddress.ip_network((ip, 64), strict=False))
    return str(ip)


class Crowds:
    """All waiting connections of one server."""

    def __init__(self) -> None:
        self.strangers: Waiting[HttpConnection] = Waiting(
            STRANGERS, STRANGERS_PER_ADDRESS
        )
        self.signed_in: Waiting[HttpConnection] = Waiting(SIGNED_IN, SIGNED_IN)
        self._logged = float("-inf")

    def log_full(self, now: float) -> None:
        """Log that too many connections have not signed in, once a minute at most."""
        if now - self._logged >= _LOG_EVERY_S:
            self._logged = now
            log.warning(
                "too many connections wait that have not signed in: the oldest are "
                "closed, those of people who have signed in are not"
            )


class HttpConnection:
    """One connection, from its acceptance to its end.

    Args:
        transport: The transport of the connection.
        crowds: The groups in which it waits.

    """

    def __init__(self, transport: asyncio.Transport, crowds: Crowds) -> None:
        self._transport = transport
        self._crowds = crowds
        self._crowd: Waiting[HttpConnection] | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._ended = False
        peer = transport.get_extra_info("peername")
        self._origin = origin_of(str(peer[0])) if isinstance(peer, tuple) else ""
        self._wait_in(crowds.strangers)

    @contextlib.contextmanager
    def serving(self) -> Iterator[None]:
        """Stop waiting while a request of a person who has signed in is served."""
        self._leave()
        try:
            yield
        finally:
            self._rest()

    def ended(self) -> None:
        """Called when the transport is closed: the connection waits no longer."""
        self._ended = True
        self._leave()

    def _rest(self) -> None:
        if self._ended or self._transport.is_closing():
            return
        if self._transport.get_write_buffer_size() > 0:
            # A large answer over a slow connection is still being sent.
            self._timer = _loop().call_later(_FLUSH_S, self._rest)
        else:
            self._wait_in(self._crowds.signed_in)

    def _wait_in(self, crowd: "Waiting[HttpConnection]") -> None:
        self._crowd = crowd
        self._timer = _loop().call_later(WAITING_S, self._end, crowd)
        other = crowd.add(self, self._origin)
        if other is not None:
            other._crowd = None
            other._end(crowd)
            self._crowds.log_full(_loop().time())

    def _leave(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._crowd is not None:
            self._crowd.remove(self, self._origin)
            self._crowd = None

    def _end(self, crowd: "Waiting[HttpConnection]") -> None:
        self._leave()
        if crowd is self._crowds.strangers:
            self._transport.abort()
        else:
            # The system may still have to send the end of an answer.
            self._transport.close()


class WebSocketProtocol(WebSocketsSansIOProtocol):
    """Ends connections that do not answer, and passes on texts that are not UTF-8.

    uvicorn waits for a peer that reads nothing as long as the system does, and does not
    inform the application meanwhile.
    """

    def keepalive_timeout(self) -> None:
        """End the connection at once, because a ping was not answered in time."""
        self.pong_timer = None
        if self.close_sent or self.transport.is_closing():
            return
        why = f"this page answered nothing for {self.ping_timeout:g} s"
        self.queue.put_nowait(
            {"type": "websocket.disconnect", "code": 1006, "reason": why}
        )
        self.conn.fail(1011, why)
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.close_sent = True
        if self.transport.get_write_buffer_size() > 0:
            self.transport.abort()  # the page would not get the rest
        else:
            self.transport.close()

    def on_task_complete(self, task: "asyncio.Task[None]") -> None:
        """Give a page that does not read its close frame a limited time for that."""
        super().on_task_complete(task)
        if not self.disconnected:
            self.loop.call_later(self.close_timeout + _FLUSH_S, self.transport.abort)

    def send_receive_event_to_app(self) -> None:
        """Pass on a complete message; one that is not UTF-8 as bytes.

        uvicorn ends the connection of such a text without informing the application,
        and logs a traceback. The application refuses it like every binary message, and
        can first check whether it is a STOP (S10).
        """
        if self.curr_msg_data_type == "text":
            try:
                b"".join(self.frames).decode()
            except UnicodeDecodeError:
                self.curr_msg_data_type = "bytes"
        super().send_receive_event_to_app()


def connection_of(scope: Scope) -> HttpConnection | None:
    """Return the connection of a request; None if another server accepted it."""
    return cast(HttpConnection | None, scope.get("state", {}).get(_KEY))


def protocols() -> tuple[type[H11Protocol], type[WebSocketProtocol]]:
    """Return the HTTP and WebSocket protocols for one server."""
    crowds = Crowds()

    class Http(H11Protocol):
        """HTTP on a connection that waits for a sign-in."""

        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            self.app_state = {**self.app_state, _KEY: HttpConnection(transport, crowds)}

        def connection_lost(self, exc: Exception | None) -> None:
            self.app_state[_KEY].ended()
            super().connection_lost(exc)

    class Socket(WebSocketProtocol):
        """A WebSocket on the connection that requested it."""

        def connection_lost(self, exc: Exception | None) -> None:
            self.app_state[_KEY].ended()
            super().connection_lost(exc)

        async def send(self, message: Any) -> None:
            await super().send(message)
            if message["type"] == "websocket.http.response.body":
                # Otherwise uvicorn logs that the refused socket was never completed.
                self.handshake_complete = True

    return Http, Socket


def _loop() -> asyncio.AbstractEventLoop:
    return asyncio.get_running_loop()
