"""Viewers that draw nothing: they receive and acknowledge frames, like a page.

Each has a socket to the gates too, as a page has, and sends no command.

Run as ``python -m benchmarks.watchers URL COUNT SECONDS``. Prints ``ready`` when all
have received a frame, then JSON with the data received in the seconds after that.
"""

import asyncio
import json
import re
import struct
import sys
from urllib.parse import urlsplit

import httpx
from websockets.asyncio.client import ClientConnection, connect

HEAD = struct.Struct("<HBI")
"""Version, flags and number of a frame."""


class Watcher:
    """One viewer's socket."""

    def __init__(self, link: ClientConnection) -> None:
        self.link = link
        self.bytes = 0
        self.frames = 0
        self.first = asyncio.Event()

    async def watch(self, name: str) -> None:
        """Send hello, then acknowledge frame after frame."""
        container = {"webmap_container": [1200, 900]}
        hello = {"op": "hello", "page": name, "url": "/", "width": 1200, "height": 900}
        await self.link.send(json.dumps(hello | {"containers": container}))
        async for frame in self.link:
            if isinstance(frame, bytes):
                self.bytes += len(frame)
                self.frames += 1
                number = HEAD.unpack_from(frame)[2]
                await self.link.send(json.dumps({"op": "seen", "frame": number}))
                self.first.set()


async def open_links(url: str, name: str) -> tuple[ClientConnection, ClientConnection]:
    """Open both sockets like a separate browser, with a key for the token.

    Returns:
        The sockets of ``/scene`` and ``/drive``.

    """
    async with httpx.AsyncClient(follow_redirects=True) as client:
        page = (await client.get(url)).raise_for_status().text
    key = re.search(r'name="webmap-key" content="([^"]+)"', page)
    assert key, "the sign-in page contains no key"
    place = urlsplit(url)
    scene, drive = [
        await connect(
            f"ws://{place.netloc}/_webmap/{path}?page=/&id={name}",
            origin=f"http://{place.netloc}",  # type: ignore[arg-type]  # a NewType
            subprotocols=["webmap", key[1]],  # type: ignore[list-item]  # as above
            compression=None,
            max_size=None,
        )
        for path in ("scene", "drive")
    ]
    return scene, drive


async def read(link: ClientConnection) -> None:
    """Read what comes on a socket, and use nothing of it."""
    async for _ in link:
        pass


async def main(url: str, count: int, seconds: float) -> None:
    """Watch with ``count`` viewers and print the received amounts."""
    watchers = []
    tasks = []
    for number in range(count):
        name = f"watcher{number:04d}"
        scene, drive = await open_links(url, name)
        watcher = Watcher(scene)
        tasks.append(asyncio.create_task(read(drive)))
        watchers.append(watcher)
        tasks.append(asyncio.create_task(watcher.watch(name)))
    async with asyncio.timeout(90):
        for watcher in watchers:
            await watcher.first.wait()
    await asyncio.sleep(1.0)
    for watcher in watchers:
        watcher.bytes = watcher.frames = 0
    print("ready", flush=True)
    await asyncio.sleep(seconds)
    received = {
        "bytes": sum(watcher.bytes for watcher in watchers) / count / seconds,
        "frames": sum(watcher.frames for watcher in watchers) / count / seconds,
    }
    print(json.dumps(received), flush=True)
    for task in tasks:
        task.cancel()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], int(sys.argv[2]), float(sys.argv[3])))
