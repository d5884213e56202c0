"""The HTTP connections of the cameras' clients; no client delays another."""

import asyncio
import contextlib
import html
import logging
import socket
from urllib.parse import quote

from webmap.ros.rosbridge.server.encode import Publication
from webmap.ros.rosbridge.server.graph import Graph
from webmap.sim.web_video.request import NoPicture, Refusal, Request, read_request

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
        except Refusal as refusal:
            text = f"{refusal}\n".encode()
            await _send(writer, refusal.status, "text/plain; charset=utf-8", text)

    async def _read(self, reader: asyncio.StreamReader) -> Request:
        if len(self._clients) > MOST_CONNECTIONS:
            raise Refusal(
                503,
                f"{MOST_CONNECTIONS} clients are connected, which is the limit; "
                "close one of them",
            )
        try:
            async with asyncio.timeout(PATIENCE):
                head = await reader.readuntil(b"\r\n\r\n")
        except TimeoutError:
            raise Refusal(
                408, f"no complete request came within {PATIENCE:g} s"
            ) from None
        except asyncio.LimitOverrunError:
            raise Refusal(431, f"a request has at most {MOST_HEAD} bytes") from None
        except asyncio.IncompleteReadError:
            raise ConnectionError(
                "the client closed the connection before the end of its request"
            ) from None
        request = read_request(head)
        known = image_topics(self.graph)
        if request.what != "list" and request.topic not in known:
            raise Refusal(
                404,
                f"there is no camera on {request.topic!r:.200}; there are: "
                f"{', '.join(known) or 'none'}",
            )
        return request

    async def _send_snapshot(
        self, request: Request, writer: asyncio.StreamWriter
    ) -> None:
        newest = NewestPicture(self.graph, request.topic)
        try:
            async with asyncio.timeout(PATIENCE):
                picture, stamp = await _next(newest, request)
        except TimeoutError:
            raise Refusal(
                503, f"no picture came on {request.topic} for {PATIENCE:g} s"
            ) from None
        finally:
            newest.close()
        await _send(writer, 200, "image/jpeg", picture, f"X-Timestamp: {stamp:.6f}")

    async def _stream(
        self,
        request: Request,
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


async def _next(newest: NewestPicture, request: Request) -> tuple[bytes, float]:
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
    newest: NewestPicture, request: Request, writer: asyncio.StreamWriter
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
