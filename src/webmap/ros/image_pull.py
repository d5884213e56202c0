"""Repeated download of the pictures of a camera on the web."""

import asyncio
import socket
import ssl
from collections.abc import Callable
from email.message import Message

from webmap.base.errors import ProtocolError
from webmap.ros.backoff import Backoff
from webmap.ros.image_address import Address
from webmap.ros.messages_image import MAX_BYTES

PATIENCE = 10.0
"""Longest time for the next complete picture, in seconds, even if bytes come."""

_CHUNK = 1 << 16


class Pull:
    """One connection to a camera, reopened whenever it ends; a service of the process.

    A stream is read as fast as it comes, since a camera that must wait would send old
    pictures, and its newest picture is shown. A single picture is requested again and
    again. Redirects are not followed.

    Args:
        address: Where the camera is.
        throttle: The least time between two pictures, in seconds.
        show: Called with each picture.
        complain: Called with the reason of each failure; afterwards WebMap connects
            again, until the pull is stopped.
        patience: Longest time for the next complete picture, in seconds.
        backoff: The delays between attempts.

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
        """Begin to connect and to download."""
        self._task = loop.create_task(self._pull_forever())

    async def stop(self) -> None:
        """Disconnect, and wait until that is done."""
        task = self._task
        self.hang_up()
        if task is not None:
            await asyncio.wait([task])

    def hang_up(self) -> None:
        """Disconnect; the second call has no effect."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()

    async def _pull_forever(self) -> None:
        now = asyncio.get_running_loop().time
        while True:
            began, reason = now(), None
            try:
                streams = await self._pull()
            except (ProtocolError, OSError, UnicodeError) as error:
                reason = self._describe(error)
            else:
                reason = "it closed the connection" if streams else None
            if reason is None:
                await asyncio.sleep(max(0.0, began + self._throttle - now()))
            else:
                self._complain(reason)
                await asyncio.sleep(self._backoff.next(now() - began))

    async def _pull(self) -> bool:
        """Read pictures until the answer ends; return whether it was a stream."""
        address, self._newest = self._address, None
        if address.tls and self._trust is None:
            # Loading the certificates takes 0.1 s and must not delay other cameras.
            self._trust = await asyncio.to_thread(ssl.create_default_context)
        async with asyncio.timeout(self._patience):
            reader, writer = await asyncio.open_connection(
                address.host, address.port, ssl=self._trust
            )
        try:
            writer.write(address.request)
            return await self._read(reader)
        finally:
            # Data that has not been sent or read yet is of no use now.
            writer.transport.abort()

    async def _read(self, reader: asyncio.StreamReader) -> bool:
        now = asyncio.get_running_loop().time
        answer, deadline = HttpResponseParser(), now() + self._patience
        while True:
            due = self._shown_at + self._throttle
            waits = self._newest is not None and due < deadline
            try:
                async with asyncio.timeout_at(due if waits else deadline):
                    data = await reader.read(_CHUNK)
            except TimeoutError:
                if not waits:
                    raise
                self._show_newest(now())
                continue
            pictures = answer.feed(data) if data else answer.end()
            if pictures:
                self._newest, deadline = pictures[-1], now() + self._patience
            if answer.streams is False and pictures:
                self._show_newest(now())
                return False
            if not data:
                return bool(answer.streams)
            if self._newest is not None and now() >= due:
                self._show_newest(now())

    def _show_newest(self, now: float) -> None:
        picture, self._newest = self._newest, None
        self._shown_at = now
        if picture is not None:
            self._show(picture)

    def _describe(self, error: Exception) -> str:
        if isinstance(error, ProtocolError):
            return str(error)
        if isinstance(error, TimeoutError):
            return f"no picture came for {self._patience:g} s"
        if isinstance(error, ConnectionRefusedError):
            return "nothing listens there"
        # UnicodeError: the host name is invalid, such as "cam..local".
        if isinstance(error, socket.gaierror | UnicodeError):
            return "there is no such host"
        if isinstance(error, ssl.SSLCertVerificationError):
            return f"its certificate is not trusted: {error.verify_message}"
        if isinstance(error, ssl.SSLError):
            return "the server there does not speak TLS"
        return f"the connection failed: {getattr(error, 'strerror', None) or error}"


MAX_HEAD = 16_384
"""Most bytes of the head of an answer."""

_ENDS = (b"\r\n\r\n", b"\n\n")

_STATUS_REASONS = {
    401: "it requires a user and a password; write them before the host in the address",
    403: "access is forbidden",
    404: "there is nothing at this address",
    503: "it has no picture now",
}


class HttpResponseParser:
    """Parser of an HTTP answer, of a stream or of a single picture."""

    def __init__(self) -> None:
        self.streams: bool | None = None
        """Whether pictures follow each other; None until the head is complete."""
        self._head = bytearray()
        self._parts: Multipart | None = None
        self._body = bytearray()
        self._length: int | None = None

    def feed(self, data: bytes) -> list[bytes]:
        """Add received bytes and return the pictures that are now complete.

        Raises:
            ProtocolError: If the answer is not that of a camera.

        """
        if self.streams is None:
            self._head += data
            found = [(self._head.find(end), len(end)) for end in _ENDS]
            ends = [(place, size) for place, size in found if place >= 0]
            if not ends:
                if len(self._head) > MAX_HEAD:
                    raise ProtocolError(
                        f"its answer begins with {MAX_HEAD} bytes of head"
                    )
                return []
            end, size = min(ends)
            data = bytes(self._head[end + size :])
            self._read_head(bytes(self._head[:end]))
        if self._parts is not None:
            return self._parts.feed(data)
        self._body += data
        if len(self._body) > MAX_BYTES:
            raise ProtocolError(f"a picture of more than {MAX_BYTES} bytes")
        if self._length is not None and len(self._body) >= self._length:
            return [self._take(self._length)]
        return []

    def end(self) -> list[bytes]:
        """Handle the end of the connection; the rest may be a picture.

        Raises:
            ProtocolError: If the connection ended too early.

        """
        if self.streams is None:
            raise ProtocolError("it closed the connection without an answer")
        if self.streams or not self._body:
            return []
        if self._length is not None:
            raise ProtocolError("it closed the connection in the middle of a picture")
        return [self._take(len(self._body))]

    def _take(self, length: int) -> bytes:
        picture = bytes(self._body[:length])
        self._body.clear()
        return picture

    def _read_head(self, head: bytes) -> None:
        first, *lines = head.decode("latin-1").splitlines() or [""]
        parts = first.split(None, 2)
        if (
            len(parts) < 2
            or not parts[0].startswith("HTTP/")
            or not parts[1].isdecimal()
        ):
            raise ProtocolError("the server there does not speak HTTP")
        status = int(parts[1][:4])
        headers = {
            name.strip().lower(): value.strip()
            for name, _, value in (line.partition(":") for line in lines)
        }
        _check_status(status)
        kind = Message()
        kind["Content-Type"] = headers.get("content-type", "")
        media = kind.get_content_type() if headers.get("content-type") else "nothing"
        if media.startswith("multipart/"):
            self._parts = Multipart(str(kind.get_param("boundary") or ""))
        elif not media.startswith("image/"):
            raise ProtocolError(
                f"it answers with {_plain(media)}, expected pictures (image/jpeg, or "
                "multipart/x-mixed-replace); this must be the address of the pictures "
                "themselves, not that of a page that shows them"
            )
        if headers.get("transfer-encoding", "identity").lower() != "identity":
            raise ProtocolError("it answers in chunks, which WebMap did not request")
        length = headers.get("content-length", "")
        if self._parts is None and length.isdecimal() and len(length) < 12:
            self._length = int(length)
            if self._length > MAX_BYTES:
                raise ProtocolError(f"a picture of {length} bytes, {MAX_BYTES} at most")
        self.streams = self._parts is not None


def _check_status(status: int) -> None:
    if 300 <= status < 400:
        raise ProtocolError(
            f"it answers {status} and redirects to another address, which is not "
            "followed; use the address of the pictures"
        )
    if status != 200:
        reason = _STATUS_REASONS.get(status, "200 was expected")
        raise ProtocolError(f"it answers {status}: {reason}")


def _plain(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text[:60])


MAX_HEADERS = 8192
"""Most bytes of the headers before one picture."""


class Multipart:
    """Parser of a ``multipart/x-mixed-replace`` answer.

    Cameras write this format differently. The length of a part may be stated or not,
    lines may end with or without a carriage return, and the stated boundary may include
    the two dashes that precede it in the body.

    Args:
        boundary: The boundary from the ``Content-Type`` of the answer.

    Raises:
        ProtocolError: If the boundary is empty.

    """

    def __init__(self, boundary: str) -> None:
        name = boundary.strip().strip('"').lstrip("-").encode("latin-1", "replace")
        if not name or len(name) > 200:
            raise ProtocolError("its answer names no boundary between pictures")
        self._mark = b"--" + name
        self._rest = bytearray()
        self._searched = 0
        self._in_part = False
        self._length: int | None = None

    def feed(self, data: bytes) -> list[bytes]:
        """Add received bytes and return the pictures that are now complete.

        Raises:
            ProtocolError: If a picture is too long, or the format is wrong.

        """
        self._rest += data
        pictures: list[bytes] = []
        while True:
            if not self._in_part and not self._begin():
                return pictures
            picture = self._picture()
            if picture is None:
                return pictures
            if picture:
                pictures.append(picture)

    def _begin(self) -> bool:
        """Skip to the beginning of a picture; return whether it has come."""
        at = self._rest.find(self._mark)
        if at < 0:
            if len(self._rest) > MAX_HEADERS:
                raise ProtocolError("its answer has no boundary between pictures")
            return False
        line = self._rest.find(b"\n", at)
        found = [(self._rest.find(end, line), len(end)) for end in _BLANK_LINES]
        ends = [(place, size) for place, size in found if line >= 0 and place >= 0]
        if not ends:
            if len(self._rest) - at > MAX_HEADERS:
                raise ProtocolError(f"more than {MAX_HEADERS} bytes before a picture")
            return False
        end, size = min(ends)
        self._length = _length(bytes(self._rest[line:end]))
        del self._rest[: end + size]
        self._in_part, self._searched = True, 0
        return True

    def _picture(self) -> bytes | None:
        rest = self._rest
        if self._length is not None:
            end = self._length if len(rest) >= self._length else -1
        else:
            # Search only new bytes, and the last old ones, which may begin a mark.
            end = rest.find(self._mark, self._searched)
            self._searched = max(0, len(rest) - len(self._mark))
        if end < 0:
            if len(rest) > MAX_BYTES:
                raise ProtocolError(f"a picture of more than {MAX_BYTES} bytes")
            return None
        picture = bytes(rest[:end])
        if self._length is None:
            picture = picture.removesuffix(b"\n").removesuffix(b"\r")
        del rest[:end]
        self._in_part = False
        return picture


_BLANK_LINES = (b"\n\r\n", b"\n\n")


def _length(headers: bytes) -> int | None:
    """Return the stated length of a part, None if there is none.

    Raises:
        ProtocolError: If the length is not a number, or too large for a picture.

    """
    for line in headers.splitlines():
        name, _, value = line.partition(b":")
        if name.strip().lower() != b"content-length":
            continue
        value = value.strip()
        # Some cameras state 0 for an unknown length.
        if not value.isdigit() or len(value) > 12:
            raise ProtocolError(f"a picture of {value[:20]!r} bytes")
        if int(value) > MAX_BYTES:
            raise ProtocolError(f"a picture of {int(value)} bytes, {MAX_BYTES} at most")
        return int(value) or None
    return None
