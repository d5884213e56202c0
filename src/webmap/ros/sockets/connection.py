"""One WebSocket connection to a bridge, kept open or opened once."""

import asyncio
import logging
import socket
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from math import inf
from typing import TYPE_CHECKING

from webmap.base.errors import BridgeClosed
from webmap.base.processes import load
from webmap.ros.backoff import Backoff
from webmap.ros.limits import MAX_FRAME
from webmap.ros.received_message import LinkState

if TYPE_CHECKING:
    from webmap.ros.sockets.websocket import WebSocketConnection

log = logging.getLogger("webmap.ros")

CONNECT_TIMEOUT = 5.0
MAX_UNSENT = 4 << 20

LOOK_PERIOD = 0.25

CLOSED_HERE = "WebMap closed the connection"


class BridgeConnection:
    """A connection that sends and receives frames without reading them.

    Frames that cannot be sent now are refused, and unsent frames are dropped when the
    connection ends: nothing waits for a later connection.

    Args:
        url: The bridge's address.
        opened: Called when the connection is open.
        received: Called with each message, text or binary, as bytes.
        closed: Called with the reason when an open connection has ended.
        failed: Called with the error when the connection could not be opened.
        again: Whether to reopen it whenever it ends or fails.
        busy: Returns whether the bridge may be busy with a large message that was
            requested.
        subprotocols: The subprotocols to offer; the bridge must accept one of them.
        named: How errors name the bridge: its kind.

    """

    def __init__(
        self,
        url: str,
        *,
        opened: Callable[[], None],
        received: Callable[[bytes | bytearray], None],
        closed: Callable[[str], None],
        failed: Callable[[BridgeClosed], None],
        again: bool = True,
        busy: Callable[[], bool] = lambda: False,
        subprotocols: Sequence[str] = (),
        named: str = "rosbridge",
    ) -> None:
        self.url = url
        self.state: LinkState = "new"
        self._socket: WebSocketConnection | None = None
        self._heard: float | None = None
        """When the last bytes of the socket before came."""
        self._liveness: Liveness | None = None
        self._opened = opened
        self._received = received
        self._closed = closed
        self._failed = failed
        self._again = again
        self._busy = busy
        self._subprotocols = subprotocols
        self._named = named
        self._task: asyncio.Task[None] | None = None
        self._unsent: deque[bytes] = deque()
        self._unsent_size = 0

    @property
    def last_heard(self) -> float | None:
        """When the last bytes came, including pongs, on the monotonic clock."""
        return self._heard if self._socket is None else self._socket.bytes_came

    @property
    def lag(self) -> float:
        """Approximate delay of the data that now comes, from pings, in seconds."""
        if self._liveness is None:
            return 0.0
        return self._liveness.lag(time.monotonic())

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to connect; a second call while it runs has no effect."""
        if self._task is None and self.state in ("new", "closed"):
            self.state = "connecting"
            self._wake = asyncio.Event()
            self._task = loop.create_task(self._run())

    async def stop(self) -> None:
        """Close the connection and do not reopen it."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.wait([task])
        self.state = "closed"

    def send(self, frame: bytes) -> None:
        """Send ``frame`` now.

        Raises:
            BridgeClosed: If the connection is not open, or accepts no more data.

        """
        if self.state == "new":
            raise BridgeClosed(f"the connection to {self.url} was never opened")
        if self.state != "open":
            raise BridgeClosed(
                f"the connection to {self.url} is not open ({self.state})"
            )
        self._send(frame)

    def _send(self, frame: bytes) -> None:
        """Send a frame on an open connection: JSON as text; it begins with a brace."""
        if self._unsent_size + len(frame) > MAX_UNSENT:
            raise BridgeClosed(
                f"the connection to {self.url} accepts no more data: "
                f"{self._unsent_size} bytes are not sent yet"
            )
        self._unsent.append(frame)
        self._unsent_size += len(frame)
        self._wake.set()

    async def _run(self) -> None:
        backoff = Backoff()
        try:
            while True:
                self.state = "connecting"
                lasted = await self._one_link()
                if not self._again:
                    break
                await asyncio.sleep(backoff.next(lasted))
        finally:
            self.state = "closed"
            self._task = None

    async def _one_link(self) -> float:
        """Connect, serve the connection until it ends, and return its duration."""
        try:
            link = await connect_to(self.url, self._subprotocols)
        except Exception as error:  # name lookup, TCP, TLS, handshake: all the same
            self._failed(_not_reached(self._named, self.url, error))
            return 0.0
        began = time.monotonic()
        reason = CLOSED_HERE
        try:
            reason = await self._serve(link)
        except asyncio.CancelledError:
            await close_soon(link)
            raise
        finally:
            self._forget_link(link)
            self._closed(reason)
        return time.monotonic() - began

    async def _serve(self, socket: "WebSocketConnection") -> str:
        """Send and receive frames until the connection ends; return the reason."""
        self.state, self._socket = "open", socket
        keeping = asyncio.create_task(self._keep_alive(socket))
        writing = asyncio.create_task(self._write(socket))
        try:
            self._opened()
            socket.deliver_to(self._deliver)
            await socket.wait_closed()
            if keeping.done() and not keeping.cancelled() and not keeping.exception():
                return f"no answer to a ping for {Liveness.LIMIT:g} s"
            return _why(socket.protocol.close_exc)
        finally:
            socket.ignore_messages()
            keeping.cancel()
            writing.cancel()
            await asyncio.wait([keeping, writing])

    def _deliver(self, frame: bytes | bytearray) -> None:
        if self._task is None:  # it is being stopped
            return
        try:
            self._received(frame)
        except Exception:
            log.exception("%s: a frame of %d bytes was lost", self.url, len(frame))

    def _forget_link(self, socket: "WebSocketConnection") -> None:
        socket.transport.abort()
        self._socket, self._heard = None, socket.bytes_came
        self._liveness = None
        self.state = "connecting" if self._again else "closed"
        self._unsent.clear()
        self._unsent_size = 0

    async def _write(self, socket: "WebSocketConnection") -> None:
        from websockets.exceptions import ConnectionClosed

        try:
            while True:
                await self._wake.wait()
                self._wake.clear()
                while self._unsent:
                    frame = self._unsent.popleft()
                    await socket.send(frame, text=frame.startswith(b"{"))
                    self._unsent_size -= len(frame)
        except ConnectionClosed:
            pass  # the reader reports it

    async def _keep_alive(self, socket: "WebSocketConnection") -> None:
        """Send pings; drop the connection and return when it is dead."""
        self._liveness = liveness = Liveness(time.monotonic())
        pinging: set[asyncio.Task[None]] = set()
        try:
            while not liveness.is_dead(
                time.monotonic(), socket.bytes_came, busy=self._busy
            ):
                if liveness.is_ping_due(time.monotonic()):
                    liveness.pinged(time.monotonic())
                    pinging = {asyncio.create_task(self._ping(socket, liveness))}
                await asyncio.sleep(LOOK_PERIOD)
            socket.transport.abort()
        finally:
            for task in pinging:
                task.cancel()

    async def _ping(self, socket: "WebSocketConnection", liveness: "Liveness") -> None:
        from websockets.exceptions import ConnectionClosed

        try:
            # If the connection accepts no bytes, this send waits: also unanswered.
            await (await socket.ping())
        except ConnectionClosed:
            return
        liveness.ponged(time.monotonic())


async def connect_to(url: str, subprotocols: Sequence[str]) -> "WebSocketConnection":
    """Return an open connection to a bridge.

    Raises:
        OSError: If the bridge cannot be reached, or accepts none of the subprotocols.
        websockets.exceptions.WebSocketException: If it refuses the connection.

    """
    await load("webmap.ros.sockets.websocket")

    from websockets.asyncio.client import connect
    from websockets.typing import Subprotocol

    from webmap.ros.sockets.websocket import CLOSE_TIMEOUT, WebSocketConnection

    class ConnectHere(connect):
        """Connect to the given address, without redirects."""

        def process_redirect(self, exc: Exception) -> Exception | str:
            return exc

    socket = await ConnectHere(
        url,
        compression=None,
        subprotocols=[Subprotocol(name) for name in subprotocols] or None,
        max_size=MAX_FRAME,
        open_timeout=CONNECT_TIMEOUT,
        ping_interval=None,
        close_timeout=CLOSE_TIMEOUT,
        proxy=None,
        user_agent_header=None,
        create_connection=WebSocketConnection,
    )
    assert isinstance(socket, WebSocketConnection)
    if subprotocols and socket.subprotocol is None:
        await close_soon(socket)
        raise ConnectionError(
            f"the server there accepts none of {', '.join(subprotocols)}: it is of "
            "another kind, such as a rosbridge, whose address begins with ws://"
        )
    if subprotocols:
        socket.acknowledge_at_once()
    return socket


async def close_soon(socket: "WebSocketConnection") -> None:
    """Close a connection; wait for the bridge for half a second at most."""
    with suppress(TimeoutError):
        async with asyncio.timeout(0.5):
            await socket.close()


def _not_reached(named: str, url: str, error: Exception) -> BridgeClosed:
    if isinstance(error, TimeoutError):
        why = f"no answer within {CONNECT_TIMEOUT:g} s"
    elif isinstance(error, ConnectionRefusedError):
        why = "the connection was refused, nothing listens there"
    elif isinstance(error, socket.gaierror):
        why = f"the host's name is not known ({error.strerror})"
    else:
        why = str(error) or type(error).__name__
    if "HTTP 400" in why and named == "rosbridge":
        address = url.replace("ws", "foxglove", 1)
        why += f"; if a Foxglove bridge is there, its address is {address}"
    elif "HTTP 400" in why:
        why += ": it accepts none of the subprotocols that WebMap knows"
    closed = BridgeClosed(f"cannot reach the {named} at {url}: {why}", why)
    closed.__cause__ = error
    return closed


def _why(error: Exception) -> str:
    return str(error) or "the connection was lost"


class Liveness:
    """Detects a dead connection from pings and pongs; times in monotonic seconds.

    Only one ping is open at a time. A connection without data is not dead, since a
    robot may have nothing to send. A connection is dead if its ping is not answered.
    """

    LIMIT = 3.0
    """Longest wait for the answer to a ping, in seconds."""

    PERIOD = 0.5
    """Time from one answer to the next ping, in seconds."""

    LONGEST = 60.0
    """Longest wait for the answer while a large message is received, in seconds."""

    SLOW = 0.25
    """Time from ping to pong, in seconds, from which the next ping follows at once."""

    LATE = 0.75
    """Seconds between two checks, above which this process itself was delayed."""

    def __init__(self, now: float) -> None:
        self._pinged: float | None = None
        self._took = 0.0
        self._ponged = now
        self._looked = now

    @property
    def is_waiting(self) -> bool:
        """Whether a ping is not answered yet."""
        return self._pinged is not None

    def is_ping_due(self, now: float) -> bool:
        """Return whether to ping now, which waits for the answer to the last ping."""
        if self._pinged is not None:
            return False
        return self._took >= self.SLOW or now - self._ponged >= self.PERIOD

    def pinged(self, now: float) -> None:
        """Register a sent ping."""
        self._pinged = now

    def ponged(self, now: float) -> None:
        """Register the answer to the ping."""
        if self._pinged is not None:
            self._took = now - self._pinged
        self._pinged = None
        self._ponged = now

    def lag(self, now: float) -> float:
        """Return the approximate delay of the data that now comes, in seconds.

        The answer to a ping comes after all data that was sent before it. So the delay
        of a connection with an open ping may be as large as the age of the ping. If a
        connection became slow since the newest ping, the next one shows that, 0.75 s
        later.
        """
        waiting = 0.0 if self._pinged is None else now - self._pinged
        return max(self._took, waiting)

    def is_dead(
        self,
        now: float,
        bytes_came: float = -inf,
        *,
        busy: Callable[[], bool] = lambda: False,
    ) -> bool:
        """Return whether the last ping was unanswered for too long.

        A late check decides nothing: if this process was delayed, the answer may be
        unread. The answer comes after all data that was sent before it, so a large map
        on a slow connection may delay it for as long as its bytes come.

        Args:
            now: The time of the check.
            bytes_came: When the last bytes came.
            busy: Returns whether the bridge is known to encode a large message; called
                only if nothing else shows that the connection lives.

        """
        late = now - self._looked > self.LATE
        self._looked = now
        if late or self._pinged is None or now - self._pinged <= self.LIMIT:
            return False
        silent = now - bytes_came > self.LIMIT and not busy()
        return silent or now - self._pinged > self.LONGEST
