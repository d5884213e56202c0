"""A lane: one socket to a bridge that is opened again when it ends."""

import asyncio
import logging
import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Required, TypedDict

from webmap.base.errors import BridgeClosed
from webmap.gate.lanes.budget import Budget
from webmap.gate.lanes.sockets import Socket, SocketHandlers, open_socket

FIRST_WAIT = 0.1
"""Seconds until the first attempt to connect again."""

LONGEST_WAIT = 3.0
"""Seconds between attempts at most."""

STEADY = 2.0
"""A link that lasted for this long resets the wait before the next attempt, in seconds.

A successful handshake is not enough: the gate would connect ten times a second for ever
to a bridge that ends each link at once.
"""

FIRST_FLOOD_WAIT = 1.0
"""Seconds until the next attempt after the first link that was dropped for sending too
much."""

LONGEST_FLOOD_WAIT = 60.0
"""The longest such wait, in seconds; each dropped link doubles it."""

TAME = 60.0
"""A link that lasted for this long resets that wait, in seconds."""

MOST_TROUBLES = 20
"""How many different errors are logged before a link is steady again."""


class ReconnectWaits:
    """Decides how long to wait before each attempt, and which errors are logged."""

    def __init__(self) -> None:
        self._troubles: set[str] = set()
        self._wait = FIRST_WAIT
        self._flood_wait = FIRST_FLOOD_WAIT

    def failed(self) -> float:
        """Return the seconds to wait after an attempt that failed."""
        wait = self._wait
        self._wait = min(2 * wait, LONGEST_WAIT)
        return wait

    def ended(self, lasted: float, *, flooded: bool) -> float:
        """Return the seconds to wait after a link that ended.

        Args:
            lasted: For how many seconds it was open.
            flooded: Whether it was dropped for sending too much.

        """
        if lasted >= STEADY:
            self._wait = FIRST_WAIT
            self._troubles.clear()
        if lasted >= TAME:
            self._flood_wait = FIRST_FLOOD_WAIT
        if flooded:
            wait = self._flood_wait
            self._flood_wait = min(2 * wait, LONGEST_FLOOD_WAIT)
            return wait
        return self.failed()

    def is_new(self, trouble: str) -> bool:
        """Return whether an error should be logged, and note that it was."""
        if trouble in self._troubles or len(self._troubles) == MOST_TROUBLES:
            return False
        self._troubles.add(trouble)
        return True


log = logging.getLogger("webmap.gate")

DEAD = 3.0
"""A link that has not answered a ping for this long is cut, in seconds."""


@dataclass(slots=True)
class Announcement:
    """A message that is sent whenever the lane opens, and the one that undoes it."""

    hello: bytes
    goodbye: bytes
    count: int = 1


class LaneHandlers(TypedDict, total=False):
    """The callbacks of a lane, as :class:`Lane` describes them."""

    up: Required[Callable[[], None]]
    down: Required[Callable[[], None]]
    text: Required[Callable[[bytes], None]]
    pinged: Callable[[int], None]
    pong: Callable[[int], None]


class Lane:
    """One WebSocket to a bridge, and the announcements sent whenever it opens.

    Args:
        url: The bridge's address.
        up: Called when the lane is open and its announcements are sent.
        down: Called when the lane is not open any more.
        text: Called with each message.
        pinged: Called with the number of each ping before it is sent; they grow.
        pong: Called with the number of each ping that the bridge has answered.

    """

    PING = 1.0
    """Seconds between pings."""

    def __init__(
        self,
        url: str,
        *,
        up: Callable[[], None],
        down: Callable[[], None],
        text: Callable[[bytes], None],
        pinged: Callable[[int], None] = lambda _: None,
        pong: Callable[[int], None] = lambda _: None,
    ) -> None:
        self.url = url
        self.ping_period = self.PING
        self._up = up
        self._down = down
        self._text = text
        self._pinged = pinged
        self._pong = pong
        self._holds: dict[str, Announcement] = {}
        self._socket: Socket | None = None
        self.budget = Budget()
        self._trouble: str | None = None
        """Why the last socket was lost; None if :meth:`spend` handed it over."""
        self._changed = asyncio.Event()
        self._pings = 0
        self._answered = 0
        self._answered_at = 0.0
        self._task = asyncio.get_running_loop().create_task(self._run())

    @property
    def wanted(self) -> bool:
        """Whether anything is announced, so that the socket has to be open."""
        return bool(self._holds)

    @property
    def subprotocol(self) -> str | None:
        """The subprotocol of the open socket, if it has one."""
        return None if self._socket is None else self._socket.subprotocol

    def hold(self, id: str, hello: bytes = b"", goodbye: bytes = b"") -> bool:
        """Hold the lane; ``hello`` is sent now and whenever the lane opens.

        Returns:
            Whether the lane was not held under this id before.

        """
        held = self._holds.get(id)
        if held is not None:
            held.count += 1
            return False
        self._holds[id] = Announcement(hello, goodbye)
        self._send_announcement(hello)
        return True

    def release_hold(self, id: str) -> bool:
        """Undo one :meth:`hold`; after the last one ``goodbye`` is sent.

        Returns:
            Whether it was the last one of this id.

        """
        held = self._holds[id]
        held.count -= 1
        if held.count == 0:
            del self._holds[id]
            self._send_announcement(held.goodbye)
        return held.count == 0

    def write(
        self, *messages: bytes, only_if_clear: bool, until: float = math.inf
    ) -> bool:
        """Write messages now or drop them; return whether they were written.

        Args:
            messages: The messages, which are written in one piece.
            only_if_clear: Drop it if other bytes wait to be sent before it.
            until: When it is too old, by the gate's clock.

        """
        link = self._socket
        if link is None or not link.is_open or (only_if_clear and link.unsent):
            return False
        return link.send(*messages, until=until)

    def cut(self, why: str) -> None:
        """Discard the socket, with all that it has not sent, and connect again."""
        link = self._socket
        if link is not None and link.is_behind:
            # The missing answers may wait behind the other data that it sends.
            link.drop(f"{why}, and it sends more than WebMap can process")
        elif link is not None:
            link.abort(why)

    def spend(self, handlers: SocketHandlers) -> Socket:
        """Hand the open socket over to other handlers and connect again."""
        link = self._socket
        assert link is not None  # it has just been written to
        link.handlers = handlers
        self._trouble = None
        self._drop()
        return link

    def close(self) -> None:
        """Close the socket, and open none again."""
        self._task.cancel()
        link, self._socket = self._socket, None
        if link is not None:
            link.close()

    def _send_announcement(self, data: bytes) -> None:
        if data:
            self.write(data, only_if_clear=False)

    def _lost(self, why: str) -> None:
        self._trouble = why
        self._drop()

    def _drop(self) -> None:
        self._socket = None
        self._changed.set()
        self._down()

    def _on_pong(self, data: bytes) -> None:
        number = int.from_bytes(data, "big")
        # A bridge may send pongs without a ping; those prove nothing.
        if self._answered < number <= self._pings:
            self._answered = number
            self._answered_at = asyncio.get_running_loop().time()
            self._pong(number)

    async def _run(self) -> None:
        attempts, loop = ReconnectWaits(), asyncio.get_running_loop()
        while True:
            try:
                handlers = SocketHandlers(self._text, self._on_pong, self._lost)
                link = await open_socket(self.url, handlers, self.budget)
            except BridgeClosed as error:
                if attempts.is_new(str(error)):
                    log.warning("no connection: %s", error)
                await _sleep_about(attempts.failed())
                continue
            begun, self._socket = loop.time(), link
            if link.is_open:  # it may already be closed again
                for held in list(self._holds.values()):
                    self._send_announcement(held.hello)
                self._up()
                await self._keep_pinging()
            # A bridge that closes the link but does not read would keep it, and the
            # bytes that wait in it, beside the next link.
            self.cut("the bridge is closing the connection")
            if self._trouble is None:  # the socket was handed over
                await _sleep_about(FIRST_WAIT)
                continue
            wait = attempts.ended(loop.time() - begun, flooded=link.flooded)
            if attempts.is_new(self._trouble):
                log.warning(
                    "lost the connection to %s: %s; next attempt within %.1f s",
                    self.url,
                    self._trouble,
                    wait,
                )
            await _sleep_about(wait)

    async def _keep_pinging(self) -> None:
        """Ping until the lane's socket is gone."""
        loop = asyncio.get_running_loop()
        self._answered, self._answered_at = self._pings, loop.time()
        while self._socket is not None and self._socket.is_open:
            if loop.time() - self._answered_at > DEAD:
                self.cut(f"no answer for {DEAD:g} s")
                return
            self._pings += 1
            self._pinged(self._pings)
            self._socket.ping(self._pings.to_bytes(8, "big"))
            self._changed.clear()
            alarm = loop.call_later(self.ping_period, self._changed.set)
            await self._changed.wait()
            alarm.cancel()

    def ping_every(self, period: float) -> None:
        """Ping every ``period`` seconds from now on; at once if that is more often."""
        if period < self.ping_period:
            self._changed.set()
        self.ping_period = period


async def _sleep_about(seconds: float) -> None:
    """Sleep for 50 to 100 % of ``seconds``, so that lanes do not connect together."""
    await asyncio.sleep(seconds * random.uniform(0.5, 1.0))  # noqa: S311
