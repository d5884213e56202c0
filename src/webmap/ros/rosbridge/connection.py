"""One lane to a rosbridge: a WebSocket that is kept open, or opened once."""

import asyncio
import logging
import socket
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from math import inf
from typing import TYPE_CHECKING

from webmap.base.errors import BridgeClosed
from webmap.ros.backoff import Backoff
from webmap.ros.limits import LARGE, MAX_FRAME
from webmap.ros.received import LinkState

if TYPE_CHECKING:
    from websockets.asyncio.client import ClientConnection

log = logging.getLogger("webmap.ros")

CONNECT_TIMEOUT = 5.0
MAX_UNSENT = 4 << 20

MAX_WAITING = 4
"""Whole frames that a link may hold before they are read; then its socket waits."""

RATE = 128 << 20
"""Bytes per second of large frames that are read from a link in the long run."""

TURN = 64
"""Frames that are read from a link before others get their turn."""

LOOK_PERIOD = 0.25

MOST_FRAGMENTS = 4096
"""Fragments of one message that end the link; a frame of 64 MiB makes 1025."""

MESSAGE_TOO_BIG = 1009
"""The close code of a link that ends for that."""

CLOSED_HERE = "the link was closed here"


class Lane:
    """A link that hands over frames and takes frames, and knows nothing of them.

    Frames that cannot be sent now are refused, and what was not sent when the link
    ends is thrown away: nothing waits for a later link.

    Args:
        url: The bridge's address.
        opened: Called when the link is open.
        received: Called with each message, text or binary, as bytes.
        closed: Called with the reason when an open link has ended.
        failed: Called with the error when the link could not be opened.
        again: Whether to open it again whenever it ends or fails.
        busy: Whether the bridge may be busy with something large that was asked for.

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
    ) -> None:
        self.url = url
        self.state: LinkState = "new"
        self.last_heard: float | None = None
        """When the last bytes came, answers to pings too, on the monotonic clock."""
        self._liveness: Liveness | None = None
        self._opened = opened
        self._received = received
        self._closed = closed
        self._failed = failed
        self._again = again
        self._busy = busy
        self._task: asyncio.Task[None] | None = None
        self._unsent: deque[bytes] = deque()
        self._unsent_size = 0

    @property
    def lag(self) -> float:
        """How many seconds what comes now was under way, as answers to pings show."""
        if self._liveness is None:
            return 0.0
        return self._liveness.lag(time.monotonic())

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to connect; a second call while it runs does nothing."""
        if self._task is None and self.state in ("new", "closed"):
            self.state = "connecting"
            self._wake = asyncio.Event()
            self._task = loop.create_task(self._run())

    async def stop(self) -> None:
        """Close the link and do not open it again."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.wait([task])
        self.state = "closed"

    def send(self, frame: bytes) -> None:
        """Send ``frame`` as text, now.

        Raises:
            BridgeClosed: If the link is not open, or does not take what is sent.

        """
        if self.state == "new":
            raise BridgeClosed(f"the link to {self.url} was never opened")
        if self.state != "open":
            raise BridgeClosed(f"the link to {self.url} is not open ({self.state})")
        if self._unsent_size + len(frame) > MAX_UNSENT:
            raise BridgeClosed(
                f"the link to {self.url} is stuck: {self._unsent_size} bytes unsent"
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
        """Connect, serve the link until it ends, and return how long it was open."""
        try:
            link = await _connect(self.url)
        except Exception as error:  # name lookup, TCP, TLS, handshake: all the same
            self._failed(_not_reached(self.url, error))
            return 0.0
        began = time.monotonic()
        reason = CLOSED_HERE
        try:
            reason = await self._serve(link)
        except asyncio.CancelledError:
            await _say_farewell(link)
            raise
        finally:
            self._forget_link(link)
            self._closed(reason)
        return time.monotonic() - began

    async def _serve(self, socket: "ClientConnection") -> str:
        """Carry frames both ways until the link ends; return why it did."""
        from websockets.exceptions import ConnectionClosed

        self.state, self.last_heard = "open", time.monotonic()
        keeping = asyncio.create_task(self._keep_alive(socket))
        writing = asyncio.create_task(self._write(socket))
        try:
            self._opened()
            count = 0
            while True:
                frame = await _whole_message(socket)
                self.last_heard = time.monotonic()
                self._hand_over(frame)
                if len(frame) > LARGE:
                    await asyncio.sleep(len(frame) / RATE)
                count += 1
                if count % TURN == 0:  # nothing is waited for if frames are there
                    await asyncio.sleep(0)
        except ConnectionClosed as error:
            if keeping.done() and not keeping.cancelled() and not keeping.exception():
                return f"no answer to a ping for {Liveness.LIMIT:g} s"
            return _why(error)
        finally:
            keeping.cancel()
            writing.cancel()
            await asyncio.wait([keeping, writing])

    def _hand_over(self, frame: bytes | bytearray) -> None:
        try:
            self._received(frame)
        except Exception:
            log.exception("%s: a frame of %d bytes was lost", self.url, len(frame))

    def _forget_link(self, socket: "ClientConnection") -> None:
        socket.transport.abort()
        self._liveness = None
        self.state = "connecting" if self._again else "closed"
        self._unsent.clear()
        self._unsent_size = 0

    async def _write(self, socket: "ClientConnection") -> None:
        from websockets.exceptions import ConnectionClosed

        try:
            while True:
                await self._wake.wait()
                self._wake.clear()
                while self._unsent:
                    frame = self._unsent.popleft()
                    await socket.send(frame, text=True)
                    self._unsent_size -= len(frame)
        except ConnectionClosed:
            pass  # the reader says so

    async def _keep_alive(self, socket: "ClientConnection") -> None:
        """Return when the link is dead, after having dropped it."""
        self._liveness = liveness = Liveness(time.monotonic())
        pinging: set[asyncio.Task[None]] = set()
        try:
            while not liveness.is_dead(
                time.monotonic(), _bytes_came(socket), busy=self._busy()
            ):
                if liveness.wants_ping(time.monotonic()):
                    liveness.pinged(time.monotonic())
                    pinging = {asyncio.create_task(self._ping(socket, liveness))}
                await asyncio.sleep(LOOK_PERIOD)
            socket.transport.abort()
        finally:
            for task in pinging:
                task.cancel()

    async def _ping(self, socket: "ClientConnection", liveness: "Liveness") -> None:
        from websockets.exceptions import ConnectionClosed

        try:
            # A link that takes no bytes holds up the ping itself: unanswered too.
            await (await socket.ping())
        except ConnectionClosed:
            return
        self.last_heard = time.monotonic()
        liveness.ponged(self.last_heard)


async def _connect(url: str) -> "ClientConnection":
    from websockets.asyncio.client import connect

    from webmap.ros.rosbridge.paced import PacedConnection

    class ConnectHere(connect):
        """Connect to the address that was given and to no other."""

        def process_redirect(self, exc: Exception) -> Exception | str:
            return exc

    return await ConnectHere(
        url,
        compression=None,
        max_size=MAX_FRAME,
        max_queue=MAX_WAITING,
        open_timeout=CONNECT_TIMEOUT,
        ping_interval=None,
        close_timeout=0.5,
        proxy=None,
        user_agent_header=None,
        create_connection=PacedConnection,
    )


async def _whole_message(socket: "ClientConnection") -> bytes | bytearray:
    """Return the next message.

    Not by ``recv()``: that joins the fragments of a message at once, which delays every
    other thread, by 0.1 s for 64 MiB.
    """
    message: bytes | bytearray = b""
    number = 0
    async for fragment in socket.recv_streaming(decode=False):
        number += 1
        if number == 1:
            message = fragment
        elif number == 2:
            message = bytearray(message) + fragment
        else:
            message += fragment
        if number == MOST_FRAGMENTS:
            await socket.close(MESSAGE_TOO_BIG, "too many fragments")
    return message


def _bytes_came(socket: "ClientConnection") -> float:
    """Return when the last bytes came over a socket of :func:`_connect`."""
    return float(getattr(socket, "bytes_came", -inf))


async def _say_farewell(socket: "ClientConnection") -> None:
    with suppress(TimeoutError):
        async with asyncio.timeout(0.5):
            await socket.close()


def _not_reached(url: str, error: Exception) -> BridgeClosed:
    if isinstance(error, TimeoutError):
        why = f"no answer within {CONNECT_TIMEOUT:g} s"
    elif isinstance(error, ConnectionRefusedError):
        why = "the connection was refused, nothing listens there"
    elif isinstance(error, socket.gaierror):
        why = f"the host's name is not known ({error.strerror})"
    else:
        why = str(error) or type(error).__name__
    closed = BridgeClosed(f"cannot reach the rosbridge at {url}: {why}")
    closed.why = why
    closed.__cause__ = error
    return closed


def _why(error: Exception) -> str:
    return str(error) or "the link was lost"


class Liveness:
    """Decide from the times of pings and pongs; all times in monotonic seconds.

    Only one ping is under way at a time. A link that is silent is not dead: a robot
    may have nothing to say. Dead is a link whose ping is not answered.
    """

    LIMIT = 3.0
    """Longest wait for the answer to a ping, in seconds."""

    PERIOD = 0.5
    """Time from one answer to the next ping, in seconds."""

    LONGEST = 60.0
    """Longest wait for the answer while something large is on its way, in seconds."""

    SLOW = 0.25
    """Round trip, in seconds, from which on the next ping follows at once."""

    LATE = 0.75
    """Time between two looks after which the looking itself was held up."""

    def __init__(self, now: float) -> None:
        self._pinged: float | None = None
        self._took = 0.0
        self._ponged = now
        self._looked = now

    def wants_ping(self, now: float) -> bool:
        """Return whether the next ping is due."""
        if self._pinged is not None:
            return False
        return self._took >= self.SLOW or now - self._ponged >= self.PERIOD

    def pinged(self, now: float) -> None:
        """Note that a ping was sent."""
        self._pinged = now

    def ponged(self, now: float) -> None:
        """Note that the ping was answered."""
        if self._pinged is not None:
            self._took = now - self._pinged
        self._pinged = None
        self._ponged = now

    def lag(self, now: float) -> float:
        """Return how many seconds what comes now was under way, about.

        The answer to a ping comes after all that was sent before it. So a link that
        has not answered yet may be as late as the ping is old. What became slow since
        the newest ping is seen by the next one, three quarters of a second later.
        """
        waiting = 0.0 if self._pinged is None else now - self._pinged
        return max(self._took, waiting)

    def is_dead(self, now: float, heard: float = -inf, *, busy: bool = False) -> bool:
        """Return whether the last ping went unanswered for too long.

        A look that comes late judges nothing: where this process stood still, the
        answer may lie unread. The answer comes after all that was sent before it, so a
        large map on a slow link may hold it up for as long as its bytes come.

        Args:
            now: The time of the look.
            heard: When the last bytes came.
            busy: Whether the bridge is known to encode something large.

        """
        late = now - self._looked > self.LATE
        self._looked = now
        if late or self._pinged is None or now - self._pinged <= self.LIMIT:
            return False
        silent = now - heard > self.LIMIT and not busy
        return silent or now - self._pinged > self.LONGEST
