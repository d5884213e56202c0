"""A camera on the web: a small HTTP server that answers like web_video_server."""

import asyncio
import io

from PIL import Image

BOUNDARY = "boundarydonotcross"


def a_jpeg(colour=(200, 30, 30), size=(16, 12)) -> bytes:
    file = io.BytesIO()
    Image.new("RGB", size, colour).save(file, "JPEG")
    return file.getvalue()


class CameraServer:
    """Serves ``/stream``, ``/snapshot`` and the paths that a test adds.

    Attributes:
        scripts: For each path, the bytes of the answer, and whether the server closes
            the connection after them.
        frozen: While it is set, the stream stays open and has no new pictures.
        pictures: The number of pictures that were sent.
        asked: All requests, each with its first line and its headers.
        open: The number of open connections.

    """

    def __init__(self, period: float = 0.02) -> None:
        self.scripts: dict[str, tuple[bytes, bool]] = {}
        self.frozen = False
        self.pictures = 0
        self.asked: list[str] = []
        self.open = 0
        self._period = period

    async def __aenter__(self) -> "CameraServer":
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        self.port = self._server.sockets[0].getsockname()[1]
        return self

    async def __aexit__(self, *error: object) -> None:
        self._server.close()
        tasks = [t for t in asyncio.all_tasks() if t.get_name() == "camera-connection"]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def at(self, path: str) -> str:
        return f"http://127.0.0.1:{self.port}{path}"

    async def _serve(self, reader, writer) -> None:
        asyncio.current_task().set_name("camera-connection")
        self.open += 1
        try:
            first = await reader.readexactly(1)
            if first == b"\x16":  # TLS, which this server does not support
                writer.write(b"HTTP/1.0 400 Bad Request\r\n\r\n")
                await writer.drain()
                return
            head = (first + await reader.readuntil(b"\r\n\r\n")).decode()
            self.asked.append(head)
            path = head.split()[1]
            ends = asyncio.create_task(reader.read(1))
            answers = asyncio.create_task(self._answer(path, writer))
            await asyncio.wait([ends, answers], return_when=asyncio.FIRST_COMPLETED)
            for task in (ends, answers):
                task.cancel()
            await asyncio.gather(ends, answers, return_exceptions=True)
        except (OSError, asyncio.IncompleteReadError, asyncio.CancelledError):
            pass
        finally:
            self.open -= 1
            writer.transport.abort()

    async def _answer(self, path: str, writer) -> None:
        if path in self.scripts:
            data, closes = self.scripts[path]
            writer.write(data)
            await writer.drain()
            if closes:
                writer.close()
                await writer.wait_closed()
            else:
                await asyncio.Event().wait()
        elif path.startswith("/snapshot"):
            self.pictures += 1
            picture = self.picture()
            writer.write(
                b"HTTP/1.0 200 OK\r\nContent-type: image/jpeg\r\n"
                b"Content-Length: %d\r\n\r\n" % len(picture) + picture
            )
            await writer.drain()
            writer.close()
            await writer.wait_closed()
        else:
            writer.write(
                b"HTTP/1.0 200 OK\r\nServer: web_video_server\r\n"
                b'Content-type: multipart/x-mixed-replace;boundary="%s"\r\n\r\n--%s\r\n'
                % (BOUNDARY.encode(), BOUNDARY.encode())
            )
            while True:
                if not self.frozen:
                    self.pictures += 1
                    writer.write(part(self.picture()))
                    await writer.drain()
                await asyncio.sleep(self._period)

    def picture(self) -> bytes:
        """Return the newest picture: its red component shows its number."""
        return a_jpeg((self.pictures * 5 % 256, 60, 60))


def part(picture: bytes) -> bytes:
    """Return a picture as web_video_server writes it into its stream."""
    head = "Content-type: image/jpeg\r\nX-Timestamp: 1.0\r\nContent-Length: "
    end = f"\r\n--{BOUNDARY}\r\n"
    return f"{head}{len(picture)}\r\n\r\n".encode() + picture + end.encode()
