"""Imitates a rosbridge that sends frames to one subscriber as fast as it reads.

Run as ``python -m benchmarks.player COUNT``; prints its port. It implements only the
part of the protocol that a subscription needs. It creates the WebSocket frames before,
and writes many at a time, so that the subscriber never waits for this process.
"""

import asyncio
import json
import struct
import sys
from collections.abc import Sequence

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from benchmarks.frames import TYPES, cbor_frames, json_frames

BUFFER = 1 << 20
"""Bytes that may wait to be sent."""


def framed(messages: Sequence[str | bytes]) -> list[bytes]:
    """Return WebSocket frames, each with its head, of messages above 125 bytes."""
    frames = []
    for message in messages:
        first = 0x81 if isinstance(message, str) else 0x82
        data = message.encode() if isinstance(message, str) else message
        assert 125 < len(data) < 1 << 16
        frames.append(struct.pack("!BBH", first, 126, len(data)) + data)
    return frames


async def play(link: ServerConnection, frames: Sequence[bytes], count: int) -> None:
    """Send ``count`` frames, all of ``frames`` at a time."""
    whole = b"".join(frames)
    for _ in range(count // len(frames)):
        link.transport.write(whole)
        await link.drain()
    link.transport.write(b"".join(frames[: count % len(frames)]))


async def serve_frames(count: int) -> None:
    """Serve until killed."""
    played = {(topic, False): framed(json_frames(topic)) for topic in TYPES}
    cbor = framed(cbor_frames())
    played.update({(topic, True): cbor for topic in TYPES if "scan" in topic})

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

    async with serve(
        handle, "127.0.0.1", 0, compression=None, write_limit=BUFFER
    ) as server:
        print(next(iter(server.sockets)).getsockname()[1], flush=True)
        await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(serve_frames(int(sys.argv[1])))
