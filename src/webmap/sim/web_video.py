"""Camera pictures over HTTP, with the addresses of ``web_video_server``.

``webmap sim --http-camera`` and tests use it. First the requests, without I/O, then the
connections of the clients: no client delays another.
"""

import asyncio
import contextlib
import html
import io
import logging
import socket
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal
from urllib.parse import parse_qsl, quote, urlsplit

from PIL import Image

from webmap.ros.rosbridge.server.dialect import resolve
from webmap.ros.rosbridge.server.encode import Publication
from webmap.ros.rosbridge.server.graph import Graph

MOST_SIDE = 4096
"""Most pixels along a side of a picture that is made or read."""

_TOO_LARGE = (Image.DecompressionBombError, Image.DecompressionBombWarning)


EXAMPLE = "/stream?topic=/robot_0/camera/image_raw&type=mjpeg"

_PATHS: dict[str, Literal["list", "stream", "snapshot"]] = {
    "/": "list",
    "/stream": "stream",
    "/snapshot": "snapshot",
}
_TYPES = ("mjpeg", "ros_compressed")
_MOST_PARAMETERS = 32
_SHOWN = 80


class NoPicture(Exception):
    """The message of a topic is not a readable JPEG."""


@dataclass(frozen=True, slots=True)
class PictureFormat:
    """The format of a picture; None keeps the camera's value."""

    quality: int | None = None
    """1 to 100."""

    width: int | None = None
    """In pixels; the height does not change with it."""

    height: int | None = None
    """In pixels."""

    inverted: bool = False
    """Whether the picture is rotated by half a turn."""

    @property
    def is_plain(self) -> bool:
        """Whether pictures are sent unchanged."""
        return self == PictureFormat()

    def apply(self, jpeg: bytes) -> bytes:
        """Return a picture in this format.

        Raises:
            NoPicture: If it is not a readable JPEG.

        """
        try:
            with Image.open(io.BytesIO(jpeg), formats=("JPEG",)) as opened:
                if max(opened.size) > MOST_SIDE:
                    raise NoPicture(f"a picture of {opened.width} x {opened.height}")
                shown: Image.Image = opened.convert("RGB")
        except (OSError, ValueError, SyntaxError, *_TOO_LARGE) as error:
            raise NoPicture(str(error)) from error
        size = (self.width or shown.width, self.height or shown.height)
        if size != shown.size:
            shown = shown.resize(size)
        if self.inverted:
            shown = shown.transpose(Image.Transpose.ROTATE_180)
        file = io.BytesIO()
        # 95 is the default of web_video_server.
        shown.save(file, "JPEG", quality=self.quality or 95)
        return file.getvalue()


class HttpError(Exception):
    """A refused request, with the status and the text of the answer."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status


@dataclass(frozen=True, slots=True)
class PictureRequest:
    """What an HTTP request asks for: the list of topics, a stream or one picture."""

    what: Literal["list", "stream", "snapshot"]
    topic: str = ""
    """Topic of ``sensor_msgs/Image``, as in web_video_server."""
    form: PictureFormat = field(default_factory=PictureFormat)


def read_request(head: bytes) -> PictureRequest:
    """Return the request in the head of an HTTP message.

    The parameters are those of web_video_server: ``topic``, ``type``, ``quality``,
    ``width``, ``height`` and ``invert``. Others are ignored, as in web_video_server.

    Args:
        head: All bytes up to the blank line.

    Raises:
        HttpError: If the request is invalid.

    """
    line = head.decode("latin-1").partition("\n")[0].rstrip("\r")
    parts = line.split(" ")
    if len(parts) != 3 or not parts[2].startswith("HTTP/1."):
        raise HttpError(
            400,
            f"{_plain(line)} is not a request of HTTP/1.0 or 1.1, "
            "such as GET / HTTP/1.1",
        )
    method, target, _ = parts
    if method != "GET":
        raise HttpError(405, f"use GET for pictures, got {_plain(method)}")
    try:
        address = urlsplit(target)
        parameters = dict(
            reversed(  # of two equal keys, the first is used
                parse_qsl(
                    address.query,
                    keep_blank_values=True,
                    max_num_fields=_MOST_PARAMETERS,
                )
            )
        )
    except ValueError:
        raise HttpError(
            400,
            f"{_plain(target)} is not an address with parameters, such as {EXAMPLE}",
        ) from None
    what = _PATHS.get(address.path)
    if what is None:
        raise HttpError(
            404,
            f"there is nothing at {_plain(address.path)}; there are / with a list of "
            "the cameras, /stream?topic=... and /snapshot?topic=...",
        )
    if what == "list":
        return PictureRequest(what)
    if not parameters.get("topic", "").strip("/"):
        raise HttpError(400, f"the topic of the camera is missing, as in {EXAMPLE}")
    kind = parameters.get("type", "mjpeg")
    if what == "stream" and kind not in _TYPES:
        raise HttpError(
            400, f"type must be {' or '.join(_TYPES)} here, got {_plain(kind)}"
        )
    # ros_compressed streams the messages of the camera's topic unchanged.
    as_it_is = what == "stream" and kind == "ros_compressed"
    return PictureRequest(
        what,
        resolve(parameters["topic"]),
        PictureFormat() if as_it_is else _form(parameters),
    )


def _form(parameters: Mapping[str, str]) -> PictureFormat:
    return PictureFormat(
        quality=_number(parameters, "quality", 100),
        width=_number(parameters, "width", MOST_SIDE),
        height=_number(parameters, "height", MOST_SIDE),
        inverted="invert" in parameters,
    )


def _number(parameters: Mapping[str, str], name: str, most: int) -> int | None:
    text = parameters.get(name)
    if text is None or text == "-1":  # web_video_server uses -1 for "unchanged"
        return None
    if text.isascii() and text.isdigit() and len(text) < 6 and 1 <= int(text) <= most:
        return int(text)
    raise HttpError(
        400, f"{name} must be a whole number from 1 to {most}, got {_plain(text)}"
    )


def _plain(text: str) -> str:
    cut = text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."
    return repr("".join(c if c.isprintable() else "?" for c in cut))


log = logging.getLogger("webmap.sim")

NODE = "/web_video_server"
COMPRESSED = "/compressed"
"""End of the name of an image's topic with JPEG pictures."""

_TYPE = "sensor_msgs/CompressedImage"
_JPEG = b"\xff\xd8\xff"


MOST_CONNECTIONS = 64
MOST_HEAD = 8192
"""Most bytes of a request."""

PATIENCE = 5.0
"""Seconds for a request, for a first picture, and for a client to read one."""

_BOUNDARY = "boundarydonotcross"
_SEND_BUFFER = 1 << 14
_REASONS = {
    200: "OK",
    400: "Bad Request",
    404: "Not Found",
    405: "Method Not Allowed",
    408: "Request Timeout",
    431: "Request Header Fields Too Large",
    503: "Service Unavailable",
}
_NEVER_KEPT = "Cache-Control: no-cache, no-store, must-revalidate\r\nPragma: no-cache"


def image_topics(graph: Graph) -> list[str]:
    """Return the topics of images that are available as JPEG."""
    return sorted(
        name.removesuffix(COMPRESSED)
        for name, topic in graph.topics.items()
        if topic.type == _TYPE and name.endswith(COMPRESSED)
    )


class NewestPicture:
    """Subscribes to a camera's topic and keeps the newest picture, until closed.

    Args:
        graph: The graph with the topic.
        topic: Topic of the image; one of :func:`image_topics`.

    """

    def __init__(self, graph: Graph, topic: str) -> None:
        self._graph = graph
        self._topic = topic + COMPRESSED
        self._newest: tuple[bytes, float] | None = None
        self._came = asyncio.Event()
        graph.subscribe(self, self._topic, self._take, _TYPE, node=NODE)

    async def next(self) -> tuple[bytes, float]:
        """Wait for a new picture; of several new ones, return the newest.

        Returns:
            The picture, and its stamp in seconds.

        """
        while self._newest is None:
            self._came.clear()
            await self._came.wait()
        picture, self._newest = self._newest, None
        return picture

    def close(self) -> None:
        """Unsubscribe from the topic."""
        self._graph.unsubscribe(self, self._topic)

    def _take(self, publication: Publication) -> None:
        data = publication.message["data"]
        if not data.startswith(_JPEG):
            log.warning("%s: a picture that is not JPEG is skipped", self._topic)
            return
        self._newest = data, publication.stamp
        self._came.set()


class WebVideoServer:
    """Answers ``/stream`` and ``/snapshot`` from the camera topics of a graph.

    A client that reads slowly skips pictures and gets the newest one next; one that
    reads nothing is disconnected. Pictures are computed only for connected clients.
    """

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self._clients: set[asyncio.Task[None]] = set()
        self._server: asyncio.Server | None = None

    async def start(self, host: str, port: int) -> str:
        """Listen, and return the URL, without a path.

        Raises:
            OSError: If the port is in use or the host is not on this machine.

        """
        self._server = await asyncio.start_server(
            self._serve_client, host, port, limit=MOST_HEAD
        )
        bound = self._server.sockets[0].getsockname()[1]
        name = f"[{host}]" if ":" in host else host
        return f"http://{name}:{bound}"

    async def stop(self) -> None:
        """Close every connection and stop listening."""
        if self._server:
            self._server.close()
        clients = list(self._clients)
        for client in clients:
            client.cancel()
        await asyncio.gather(*clients, return_exceptions=True)

    async def _serve_client(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._clients.add(task)
        try:
            with contextlib.suppress(OSError, TimeoutError):
                await self._answer(reader, writer)
                async with asyncio.timeout(PATIENCE):
                    writer.write_eof()
                    # Closing with unread data would lose the answer.
                    await _end_of(reader)
        except asyncio.CancelledError:
            pass  # by ``stop``; the server would log it as an error
        finally:
            self._clients.discard(task)
            writer.transport.abort()

    async def _answer(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        # A small buffer: buffered pictures are stale when the next one comes.
        writer.get_extra_info("socket").setsockopt(
            socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER
        )
        writer.transport.set_write_buffer_limits(high=0)
        try:
            request = await self._read(reader)
            if request.what == "stream":
                await self._stream(request, reader, writer)
            elif request.what == "snapshot":
                await self._send_snapshot(request, writer)
            else:
                await _send(writer, 200, "text/html; charset=utf-8", self._list())
        except HttpError as refusal:
            text = f"{refusal}\n".encode()
            await _send(writer, refusal.status, "text/plain; charset=utf-8", text)

    async def _read(self, reader: asyncio.StreamReader) -> PictureRequest:
        if len(self._clients) > MOST_CONNECTIONS:
            raise HttpError(
                503,
                f"{MOST_CONNECTIONS} clients are connected, which is the limit; "
                "close one of them",
            )
        try:
            async with asyncio.timeout(PATIENCE):
                head = await reader.readuntil(b"\r\n\r\n")
        except TimeoutError:
            raise HttpError(
                408, f"no complete request came within {PATIENCE:g} s"
            ) from None
        except asyncio.LimitOverrunError:
            raise HttpError(431, f"a request has at most {MOST_HEAD} bytes") from None
        except asyncio.IncompleteReadError:
            raise ConnectionError(
                "the client closed the connection before the end of its request"
            ) from None
        request = read_request(head)
        known = image_topics(self.graph)
        if request.what != "list" and request.topic not in known:
            raise HttpError(
                404,
                f"there is no camera on {request.topic!r:.200}; there are: "
                f"{', '.join(known) or 'none'}",
            )
        return request

    async def _send_snapshot(
        self, request: PictureRequest, writer: asyncio.StreamWriter
    ) -> None:
        newest = NewestPicture(self.graph, request.topic)
        try:
            async with asyncio.timeout(PATIENCE):
                picture, stamp = await _next(newest, request)
        except TimeoutError:
            raise HttpError(
                503, f"no picture came on {request.topic} for {PATIENCE:g} s"
            ) from None
        finally:
            newest.close()
        await _send(writer, 200, "image/jpeg", picture, f"X-Timestamp: {stamp:.6f}")

    async def _stream(
        self,
        request: PictureRequest,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
    ) -> None:
        newest = NewestPicture(self.graph, request.topic)
        # Without this, a client that disconnects between pictures would go unnoticed.
        sends = asyncio.create_task(_send_stream(newest, request, writer))
        ends = asyncio.create_task(_end_of(reader))
        try:
            await asyncio.wait([sends, ends], return_when=asyncio.FIRST_COMPLETED)
        finally:
            newest.close()
            for task in (sends, ends):
                task.cancel()
            await asyncio.gather(sends, ends, return_exceptions=True)
        writer.transport.abort()
        if not sends.cancelled():
            sends.result()

    def _list(self) -> bytes:
        rows = "".join(
            f"<li>{html.escape(topic)}"
            f" <a href='/stream?topic={quote(topic)}&amp;type=mjpeg'>stream</a>"
            f" <a href='/snapshot?topic={quote(topic)}'>snapshot</a></li>\n"
            for topic in image_topics(self.graph)
        )
        return (
            "<!DOCTYPE html>\n<html lang='en'><title>Cameras</title>\n"
            f"<h1>Cameras</h1>\n<ul>\n{rows}</ul></html>\n"
        ).encode()


async def _next(newest: NewestPicture, request: PictureRequest) -> tuple[bytes, float]:
    """Return the next picture in the requested format, and its stamp."""
    while True:
        picture, stamp = await newest.next()
        if request.form.is_plain:
            return picture, stamp
        try:
            # In a thread, because the world's clock runs in this one.
            return await asyncio.to_thread(request.form.apply, picture), stamp
        except NoPicture as error:
            log.warning("%s: a picture is skipped: %s", request.topic, error)


async def _send_stream(
    newest: NewestPicture, request: PictureRequest, writer: asyncio.StreamWriter
) -> None:
    head = (
        f"HTTP/1.0 200 OK\r\nConnection: close\r\n{_NEVER_KEPT}\r\n"
        f"Content-type: multipart/x-mixed-replace;boundary={_BOUNDARY}\r\n\r\n"
        f"--{_BOUNDARY}\r\n"
    )
    writer.write(head.encode())
    while True:
        picture, stamp = await _next(newest, request)
        part = (
            f"Content-type: image/jpeg\r\nX-Timestamp: {stamp:.6f}\r\n"
            f"Content-Length: {len(picture)}\r\n\r\n"
        )
        writer.write(part.encode() + picture + f"\r\n--{_BOUNDARY}\r\n".encode())
        async with asyncio.timeout(PATIENCE):
            await writer.drain()


async def _end_of(reader: asyncio.StreamReader) -> None:
    while await reader.read(MOST_HEAD):
        pass


async def _send(
    writer: asyncio.StreamWriter, status: int, kind: str, body: bytes, more: str = ""
) -> None:
    lines = [
        f"HTTP/1.0 {status} {_REASONS[status]}",
        "Connection: close",
        _NEVER_KEPT,
        f"Content-type: {kind}",
        f"Content-Length: {len(body)}",
        "X-Content-Type-Options: nosniff",
        *(["Allow: GET"] if status == 405 else []),
        *([more] if more else []),
    ]
    writer.write("\r\n".join([*lines, "", ""]).encode() + body)
    async with asyncio.timeout(PATIENCE):
        await writer.drain()
