"""Pulling the pictures of a camera on the web, again and again."""

import asyncio
import socket
import ssl
from collections.abc import Callable

from webmap.errors import ProtocolError
from webmap.ros.backoff import Backoff
from webmap.ros.image_address import Address
from webmap.ros.image_answer import Answer

PATIENCE = 10.0
"""Seconds for the next whole picture, however many bytes drip in."""

_CHUNK = 1 << 16


class Pull:
    """One connection to a camera, made anew whenever it ends; a service of the process.

    A stream is read as quickly as it comes, since a camera that must wait would show
    the past, and its newest picture is handed on. A single picture is asked for again.
    Where an address leads elsewhere, that is not followed.

    Args:
        address: Where the camera is.
        throttle: The least time between two pictures, in seconds.
        show: Takes each picture.
        complain: Takes what fails, in words; it is tried again until it is stopped.
        patience: Seconds for the next whole picture.
        backoff: Tells when to try again.

    """

    def __init__(
        self,
        address: Address,
        throttle: float,
        show: Callable[[bytes], None],
        complain: Callable[[str], None],
        *,
        patience: float = PATIENCE,
        backoff: Backoff | None = None,
    ) -> None:
        self._address = address
        self._throttle = throttle
        self._show = show
        self._complain = complain
        self._patience = patience
        self._backoff = backoff or Backoff()
        self._shown_at = -float("inf")
        self._newest: bytes | None = None
        self._task: asyncio.Task[None] | None = None
        self._trust: ssl.SSLContext | None = None

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Connect, and pull."""
        self._task = loop.create_task(self._pull_on())

    async def stop(self) -> None:
        """Hang up, and wait until that is done."""
        task = self._task
        self.hang_up()
        if task is not None:
            await asyncio.wait([task])

    def hang_up(self) -> None:
        """Pull no more; the second call does nothing."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()

    async def _pull_on(self) -> None:
        now = asyncio.get_running_loop().time
        while True:
            began, words = now(), None
            try:
                streams = await self._pull()
            except (ProtocolError, OSError, UnicodeError) as error:
                words = self._words(error)
            else:
                words = "it hung up" if streams else None
            if words is None:
                await asyncio.sleep(max(0.0, began + self._throttle - now()))
            else:
                self._complain(words)
                await asyncio.sleep(self._backoff.next(now() - began))

    async def _pull(self) -> bool:
        """Pull until the answer ends; return whether it was a stream."""
        address, self._newest = self._address, None
        if address.tls and self._trust is None:
            # Reading who may vouch for a name takes 0.1 s: other cameras cannot wait.
            self._trust = await asyncio.to_thread(ssl.create_default_context)
        async with asyncio.timeout(self._patience):
            reader, writer = await asyncio.open_connection(
                address.host, address.port, ssl=self._trust
            )
        try:
            writer.write(address.request)
            return await self._read(reader)
        finally:
            # Whatever is still on its way is of no use any more.
            writer.transport.abort()

    async def _read(self, reader: asyncio.StreamReader) -> bool:
        now = asyncio.get_running_loop().time
        answer, deadline = Answer(), now() + self._patience
        while True:
            due = self._shown_at + self._throttle
            waits = self._newest is not None and due < deadline
            try:
                async with asyncio.timeout_at(due if waits else deadline):
                    data = await reader.read(_CHUNK)
            except TimeoutError:
                if not waits:
                    raise
                self._hand_on(now())
                continue
            pictures = answer.feed(data) if data else answer.end()
            if pictures:
                self._newest, deadline = pictures[-1], now() + self._patience
            if answer.streams is False and pictures:
                self._hand_on(now())
                return False
            if not data:
                return bool(answer.streams)
            if self._newest is not None and now() >= due:
                self._hand_on(now())

    def _hand_on(self, now: float) -> None:
        picture, self._newest = self._newest, None
        self._shown_at = now
        if picture is not None:
            self._show(picture)

    def _words(self, error: Exception) -> str:
        if isinstance(error, ProtocolError):
            return str(error)
        if isinstance(error, TimeoutError):
            return f"no picture came for {self._patience:g} s"
        if isinstance(error, ConnectionRefusedError):
            return "nothing listens there"
        # The latter is how a name fails that no host can have, such as "cam..local".
        if isinstance(error, socket.gaierror | UnicodeError):
            return "there is no such host"
        if isinstance(error, ssl.SSLCertVerificationError):
            return f"its certificate is not trusted: {error.verify_message}"
        if isinstance(error, ssl.SSLError):
            return "what answers there does not speak TLS"
        return f"the connection failed: {getattr(error, 'strerror', None) or error}"
