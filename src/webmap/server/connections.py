"""The connections that the server has accepted, and for how long they may stay.

uvicorn has no time limit for the headers of a request, and counts every connection
alike. Here each connection waits in a bounded crowd until a request on it comes from
somebody who has signed in, and again when that request is answered.
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

log = logging.getLogger("webmap.server")

WAITING_S = 10.0
"""How long a connection may go without a request from somebody who has signed in."""

STRANGERS = 256
STRANGERS_PER_ADDRESS = 64
SIGNED_IN = 256
"""How many connections wait at most: those on which nobody has signed in yet, and those
on which somebody has, between two requests. Others push neither of these out."""

_LOG_EVERY_S = 60.0
_FLUSH_S = 1.0
_KEY = "webmap.connection"

T = TypeVar("T")


class Waiting(Generic[T]):
    """Connections that serve nobody who has signed in: so many, the newest stay.

    A newcomer is never refused: whether it has signed in is known only when its request
    has come. So the oldest one goes, of the address that has the most, and one address
    cannot push those of another out.

    Args:
        limit: How many wait at most.
        per_address: How many of one address wait at most. This does not apply to this
            machine's own: a reverse proxy or a tunnel here brings everybody.

    """

    def __init__(self, limit: int, per_address: int) -> None:
        self._limit = limit
        self._per_address = per_address
        # The oldest first; a dict, as it keeps its order and finds each at once.
        self._by_address: dict[str, dict[T, None]] = {}
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def add(self, connection: T, address: str) -> T | None:
        """Let a connection wait.

        Args:
            connection: One that does not wait.
            address: Where it comes from, as :func:`origin_of` gives it.

        Returns:
            One that must go for it, and that does not wait any more.

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
        """Note that a connection waits no more."""
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
    """Return what counts as one address: of IPv6, a whole network of 64 bits.

    Returns:
        Nothing for this machine itself, and for what is no IP address, such as the
        path of a Unix socket.

    """
    try:
        ip = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return ""
    if isinstance(ip, ipaddress.IPv6Address) and ip.ipv4_mapped is not None:
        ip = ip.ipv4_mapped
    if ip.is_loopback:
        return ""
    if ip.version == 6:
        return str(ipaddress.ip_network((ip, 64), strict=False))
    return str(ip)


class Crowds:
    """All connections of one server that serve nobody now."""

    def __init__(self) -> None:
        self.strangers: Waiting[Connection] = Waiting(STRANGERS, STRANGERS_PER_ADDRESS)
        self.signed_in: Waiting[Connection] = Waiting(SIGNED_IN, SIGNED_IN)
        self._logged = float("-inf")

    def log_full(self, now: float) -> None:
        """Log that there are too many strangers, once a minute at most."""
        if now - self._logged >= _LOG_EVERY_S:
            self._logged = now
            log.warning(
                "too many connections wait that have not signed in: the oldest are "
                "closed, those of people who have signed in are not"
            )


class Connection:
    """One connection, from when it is accepted until it ends.

    Args:
        transport: What it is made of.
        crowds: Where it waits.

    """

    def __init__(self, transport: asyncio.Transport, crowds: Crowds) -> None:
        self._transport = transport
        self._crowds = crowds
        self._crowd: Waiting[Connection] | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._ended = False
        peer = transport.get_extra_info("peername")
        self._origin = origin_of(str(peer[0])) if isinstance(peer, tuple) else ""
        self._wait_in(crowds.strangers)

    @contextlib.contextmanager
    def serving(self) -> Iterator[None]:
        """Wait no more while somebody who has signed in is served."""
        self._leave()
        try:
            yield
        finally:
            self._rest()

    def ended(self) -> None:
        """Note that the connection has ended."""
        self._ended = True
        self._leave()

    def _rest(self) -> None:
        if self._ended or self._transport.is_closing():
            return
        if self._transport.get_write_buffer_size() > 0:
            # A large answer over a slow link is still on its way.
            self._timer = _loop().call_later(_FLUSH_S, self._rest)
        else:
            self._wait_in(self._crowds.signed_in)

    def _wait_in(self, crowd: "Waiting[Connection]") -> None:
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

    def _end(self, crowd: "Waiting[Connection]") -> None:
        self._leave()
        if crowd is self._crowds.strangers:
            self._transport.abort()
        else:
            # The system may still hold the end of an answer for a slow link.
            self._transport.close()


class WebSocketProtocol(WebSocketsSansIOProtocol):
    """Hands a text that is not UTF-8 to the application as bytes.

    uvicorn ends the connection of such a text without telling the application of it,
    and logs a traceback. The application refuses it as it refuses every binary message,
    and can see before that whether it is a STOP (S10).
    """

    def send_receive_event_to_app(self) -> None:
        """Pass on a message that is whole."""
        if self.curr_msg_data_type == "text":
            try:
                b"".join(self.frames).decode()
            except UnicodeDecodeError:
                self.curr_msg_data_type = "bytes"
        super().send_receive_event_to_app()


def connection_of(scope: Scope) -> Connection | None:
    """Return the connection of a request; None if another server made it."""
    return cast(Connection | None, scope.get("state", {}).get(_KEY))


def protocols() -> tuple[type[H11Protocol], type[WebSocketProtocol]]:
    """Return what speaks HTTP and WebSocket for one server."""
    crowds = Crowds()

    class Http(H11Protocol):
        """HTTP on a connection that waits for a sign-in."""

        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            self.app_state = {**self.app_state, _KEY: Connection(transport, crowds)}

        def connection_lost(self, exc: Exception | None) -> None:
            self.app_state[_KEY].ended()
            super().connection_lost(exc)

    class Socket(WebSocketProtocol):
        """A WebSocket on the connection that asked for it."""

        def connection_lost(self, exc: Exception | None) -> None:
            self.app_state[_KEY].ended()
            super().connection_lost(exc)

        async def send(self, message: Any) -> None:
            await super().send(message)
            if message["type"] == "websocket.http.response.body":
                # Else uvicorn logs that the refused socket was forgotten.
                self.handshake_complete = True

    return Http, Socket


def _loop() -> asyncio.AbstractEventLoop:
    return asyncio.get_running_loop()
