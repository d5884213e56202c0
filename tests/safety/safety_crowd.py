"""Many viewers of one page, some of which read nothing, until standard input ends.

Started as ``safety_crowd.py URL VIEWERS SILENT``; prints ``ready`` when all
viewers have connected.
"""

import asyncio
import contextlib
import http.client
import json
import re
import sys
from urllib.parse import urljoin, urlsplit

from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed


def sign_in(url: str) -> str:
    """Exchange the token in a URL for the key of a page, as a browser does."""
    parts = urlsplit(url)
    link = http.client.HTTPConnection(parts.hostname, parts.port)
    link.request("GET", f"{parts.path}?{parts.query}")
    answer = link.getresponse()
    answer.read()
    link.request("GET", urljoin(parts.path, answer.headers["location"]))
    page = link.getresponse().read().decode()
    link.close()
    return re.search(r'name="webmap-key" content="([^"]+)"', page)[1]


async def view(url: str, key: str, number: int, silent: bool, there) -> None:
    """Connect as one page: send hello, and acknowledge each frame or read nothing."""
    address = urlsplit(url).netloc
    name = f"viewer{number:04d}"
    socket = await connect(
        f"ws://{address}/_webmap/scene?page=%2F&id={name}",
        origin=f"http://{address}",
        subprotocols=["webmap", key],
        compression=None,
        max_size=None,
        ping_interval=None,
    )
    hello = {
        "op": "hello",
        "page": name,
        "url": "/",
        "width": 800,
        "height": 600,
        "containers": {"webmap_container": [700, 500]},
    }
    await socket.send(json.dumps(hello))
    there()
    if silent:
        socket.transport.pause_reading()
        await asyncio.Event().wait()
    with contextlib.suppress(ConnectionClosed):
        frame = 0
        async for _ in socket:
            frame += 1
            await socket.send(json.dumps({"op": "seen", "frame": frame}))


async def main(url: str, viewers: int, silent: int) -> None:
    """Connect all viewers, then wait for the end of standard input."""
    key = sign_in(url)
    there = 0

    def arrived() -> None:
        nonlocal there
        there += 1
        if there == viewers:
            print("ready", flush=True)

    tasks = [
        asyncio.create_task(view(url, key, n, n < silent, arrived))
        for n in range(viewers)
    ]
    await asyncio.to_thread(sys.stdin.read)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])))
