"""Hostile rosbridges, each an async function that sends arbitrary data to a client.

``safety_hostile.beside`` starts ``safety_hostile_peers.py MODULE:FUNCTION`` as a
process for each peer. The process prints the address of the bridge, and ends when
standard input ends.
"""

import asyncio
import base64
import contextlib
import hashlib
import importlib
import json
import os
import sys

from webmap.sim.process import end_with_stdin

MORE, TEXT, BINARY, CLOSE, PING, PONG = 0, 1, 2, 8, 9, 10
"""Kinds of WebSocket frames."""

CHUNK = 1 << 18
"""Bytes of one write of a flood; asyncio reads up to 256 KiB at a time."""


def frame(opcode, body=b"", *, final=True):
    """Return one WebSocket frame as a server sends it."""
    length = len(body)
    if length < 126:
        size = bytes([length])
    elif length < 1 << 16:
        size = b"\x7e" + length.to_bytes(2, "big")
    else:
        size = b"\x7f" + length.to_bytes(8, "big")
    return bytes([opcode | 0x80 * final]) + size + body


def many(piece, size=CHUNK):
    """Return a chunk of about ``size`` bytes that repeats ``piece``."""
    return piece * max(1, size // len(piece))


class Link:
    """One client of a hostile bridge."""

    def __init__(self, reader, writer):
        self.reader = reader
        self.writer = writer

    async def request(self):
        """Read the HTTP request and return the answer that opens a WebSocket."""
        request = await self.reader.readuntil(b"\r\n\r\n")
        headers = dict(
            line.lower().split(b": ", 1) for line in request.split(b"\r\n")[1:-2]
        )
        # Not in lower case: the answer contains a hash of the key.
        at = request.lower().index(b"sec-websocket-key: ") + 19
        key = request[at : at + len(headers[b"sec-websocket-key"])]
        magic = key + b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
        accept = base64.b64encode(hashlib.sha1(magic).digest())
        return (
            b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\n"
            b"Connection: Upgrade\r\nSec-WebSocket-Accept: " + accept + b"\r\n\r\n"
        )

    async def accept(self):
        """Open the WebSocket."""
        await self.write(await self.request())

    async def write(self, data):
        """Write bytes and wait until the client has taken most of them."""
        self.writer.write(data)
        await self.writer.drain()
        # drain() does not switch tasks while the buffer has room.
        await asyncio.sleep(0)

    async def send(self, message):
        """Send one message, of any length, as JSON."""
        await self.write(frame(TEXT, json.dumps(message).encode()))

    async def repeat(self, data):
        """Write the same bytes for ever."""
        while True:
            await self.write(data)

    async def receive(self):
        """Return the next JSON message of the client; answer its pings."""
        while True:
            opcode, length = await self.reader.readexactly(2)
            length &= 0x7F
            if length > 125:
                size = await self.reader.readexactly(2 if length == 126 else 8)
                length = int.from_bytes(size, "big")
            mask = await self.reader.readexactly(4)
            masked = await self.reader.readexactly(length)
            body = bytes(b ^ mask[i % 4] for i, b in enumerate(masked))
            if opcode & 0xF == PING:
                await self.write(frame(PONG, body))
            elif opcode & 0xF == TEXT:
                return json.loads(body)

    async def read_on(self):
        """Read and ignore everything, so that the client can always write."""
        while await self.reader.read(1 << 16):
            pass


def flood(piece):
    """Return a peer that opens a WebSocket and sends ``piece`` for ever."""
    chunk = many(piece)

    async def talk(link):
        await link.accept()
        reading = asyncio.create_task(link.read_on())
        try:
            await link.repeat(chunk)
        finally:
            reading.cancel()

    return talk


tiny_texts = flood(frame(TEXT, b"{}"))
pings = flood(frame(PING, b"x" * 125))
pongs = flood(frame(PONG))
empty_frames = flood(frame(TEXT))
topics = flood(
    b"".join(
        frame(TEXT, b'{"op":"publish","topic":"/t%d","msg":{}}' % n) for n in range(999)
    )
)
status_words = flood(
    frame(TEXT, b'{"op":"status","level":"error","msg":"%s"}' % (b"no " * 30))
)


async def endless_message(link):
    """Send one endless message in frames of one byte."""
    await link.accept()
    await link.write(frame(TEXT, b"{", final=False))
    await link.repeat(many(frame(MORE, b" ", final=False)))


async def endless_headers(link):
    """Answer the handshake with endless headers."""
    await link.request()
    await link.write(b"HTTP/1.1 101 Switching Protocols\r\n")
    await link.repeat(many(b"X: y\r\n"))


async def frames_with_handshake(link):
    """Send a flood of frames together with the answer to the handshake."""
    await link.write(await link.request() + many(frame(TEXT, b"{}")))
    await link.repeat(many(frame(TEXT, b"{}")))


async def nested(link):
    """Send messages with more nested lists than Python allows, ten a second."""
    await link.accept()
    while True:
        await link.write(frame(TEXT, b'{"op":"x","a":' + b"[" * 100_000))
        await asyncio.sleep(0.1)


async def serve(talk, stop):
    """Serve a peer on a free port of the loopback address."""
    links = set()

    async def take(reader, writer):
        links.add(asyncio.current_task())
        # Otherwise asyncio logs the tasks that are cancelled at the end.
        with contextlib.suppress(
            ConnectionError, asyncio.IncompleteReadError, asyncio.CancelledError
        ):
            await talk(Link(reader, writer))
        writer.transport.abort()
        links.discard(asyncio.current_task())

    server = await asyncio.start_server(take, "127.0.0.1", 0)
    print(f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}", flush=True)
    await stop.wait()
    server.close()
    for link in list(links):
        link.cancel()
    await asyncio.gather(*links, return_exceptions=True)


async def main(name):
    """Serve the peer of this name until standard input ends."""
    # A real bridge runs on another computer and needs no processor time of this one.
    os.nice(19)
    module, function = name.split(":")
    stop = asyncio.Event()
    end_with_stdin(stop)
    await serve(getattr(importlib.import_module(module), function), stop)


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1]))
