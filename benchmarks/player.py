"""Imitates a rosbridge that sends frames to one subscriber as fast as it reads.

Run as ``python -m benchmarks.player COUNT``; prints its port. It implements only the
part of the protocol that a subscription needs.
"""

import asyncio
import itertools
import json
import sys
from collections.abc import Sequence

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from benchmarks.frames import TYPES, cbor_frames, json_frames

BATCH = 64
"""Frames after which the event loop runs other tasks."""


async def play(
    link: ServerConnection, frames: Sequence[str | bytes], count: int
) -> None:
    """Send ``count`` frames, then wait until the client disconnects."""
    for number, frame in enumerate(itertools.islice(itertools.cycle(frames), count)):
        await link.send(frame)
        if number % BATCH == 0:
            await asyncio.sleep(0)


async def serve_frames(count: int) -> None:
    """Serve until killed."""
    played: dict[tuple[str, bool], Sequence[str | bytes]] = {
        (topic, False): json_frames(topic) for topic in TYPES
    }
    played.update({(topic, True): cbor_frames() for topic in TYPES if "scan" in topic})

    async def handle(link: ServerConnection) -> None:
        playing: set[asyncio.Task[None]] = set()
        try:
            async for text in link:
                request = json.loads(text)
                if request.get("op") != "subscribe":
                    continue
                key = request["topic"], request.get("compression") == "cbor"
                playing.add(asyncio.create_task(play(link, played[key], count)))
        except ConnectionClosed:
            pass
        for task in playing:
            task.cancel()

    async with serve(handle, "127.0.0.1", 0, compression=None) as server:
        print(next(iter(server.sockets)).getsockname()[1], flush=True)
        await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(serve_frames(int(sys.argv[1])))
