"""A bridge that floods the display's link does not delay other work of the thread."""

import asyncio
import base64
import contextlib
import hashlib
import time

import pytest

from equipment.waiting import until
from webmap.ros.sockets.connection import BridgeConnection
from webmap.ros.sockets.frame_reader import MOST_FRAGMENTS
from webmap.testing import Sentinel

MAGIC = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"


@contextlib.asynccontextmanager
async def bridge(talk):
    """Serve WebSockets with ``talk(reader, writer)``; yield the address."""

    async def serve(reader, writer):
        with contextlib.suppress(ConnectionError, asyncio.IncompleteReadError):
            request = await reader.readuntil(b"\r\n\r\n")
            name, lines = b"sec-websocket-key:", request.split(b"\r\n")
            (line,) = (line for line in lines if line.lower().startswith(name))
            key = line.split(b":")[1].strip()
            accept = base64.b64encode(hashlib.sha1(key + MAGIC).digest())
            writer.write(
                b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\n"
                b"Connection: Upgrade\r\nSec-WebSocket-Accept: " + accept + b"\r\n\r\n"
            )
            await talk(reader, writer)
        writer.transport.abort()

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    try:
        yield f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}"
    finally:
        server.close()


def lane(url, seen, ended=None):
    return BridgeConnection(
        url,
        opened=lambda: seen.append("open"),
        received=seen.append,
        closed=(lambda why: None) if ended is None else ended.append,
        failed=lambda error: None,
    )


@pytest.mark.serial
@pytest.mark.parametrize(
    "piece",
    [
        b"\x81\x02{}",
        b"\x89\x7d" + b"x" * 125,
        b"\x8a\x00",
        b"\x01\x01x" + b"\0\1x" * 50,
    ],
    ids=["tiny texts", "pings", "pongs", "frames of one byte"],
)
def test_a_flood_of_frames_does_not_block_the_event_loop(piece):
    async def story():
        async def talk(reader, writer):
            reading = asyncio.create_task(reader.read())
            with contextlib.suppress(ConnectionError):
                while True:
                    writer.write(piece * ((1 << 18) // len(piece)))
                    await writer.drain()
                    await asyncio.sleep(0)
            reading.cancel()

        seen, worst = [], 0.0
        async with bridge(talk) as url:
            link = lane(url, seen)
            link.start(asyncio.get_running_loop())
            await until(lambda: seen)
            begun = time.monotonic()
            while time.monotonic() < begun + 1.0:
                before = time.monotonic()
                await asyncio.sleep(0.005)
                worst = max(worst, time.monotonic() - before)
            late = sentinel.worst(begun)
            await link.stop()
        return worst, late

    with Sentinel() as sentinel:
        worst, late = asyncio.run(story())
    assert worst < 0.1 + late, (worst, late)


def test_frames_sent_before_the_connection_ends_are_received_in_order():
    async def story():
        async def talk(reader, writer):
            frames = (b"\x82\x04%04d" % n for n in range(3000))
            writer.write(b"".join(frames))
            await writer.drain()
            writer.write_eof()
            await reader.read()

        seen = []
        async with bridge(talk) as url:
            link = lane(url, seen)
            link.start(asyncio.get_running_loop())
            await until(lambda: len(seen) >= 3001)
            await link.stop()
        return seen

    seen = asyncio.run(story())
    assert seen[:3001] == ["open", *(b"%04d" % n for n in range(3000))]


def test_a_frame_of_many_mebibytes_is_received_whole():
    body = bytes(range(256)) * (1 << 16)

    async def story():
        async def talk(reader, writer):
            writer.write(b"\x82\x7f" + len(body).to_bytes(8, "big") + body)
            writer.write(b"\x82\x05after")
            await reader.read()

        seen = []
        async with bridge(talk) as url:
            link = lane(url, seen)
            link.start(asyncio.get_running_loop())
            await until(lambda: len(seen) == 3)
            await link.stop()
        return seen

    assert asyncio.run(story()) == ["open", body, b"after"]


def test_a_message_with_too_many_fragments_closes_the_link():
    async def story():
        async def talk(reader, writer):
            writer.write(b"\x82\x05first\x01\x01x" + b"\0\1x" * (MOST_FRAGMENTS + 100))
            await reader.read()

        seen, why = [], []
        async with bridge(talk) as url:
            link = lane(url, seen, why)
            link.start(asyncio.get_running_loop())
            await until(lambda: why)
            await link.stop()
        return seen, why

    seen, why = asyncio.run(story())
    assert seen[:2] == ["open", b"first"]
    assert "too many fragments" in why[0]
