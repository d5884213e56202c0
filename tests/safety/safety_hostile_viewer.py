"""A person who has signed in and floods the display from many pages.

Run with the address of the page; prints ``ready``, and ends with its standard input.
"""

import asyncio
import contextlib
import itertools
import json
import os
import sys
import threading

from safety_corpus import CORPUS
from safety_crowd import sign_in
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException

HELLO = '{"type":"hello","width":800,"height":600,"maps":[]}'


async def flood(root, key, name, messages):
    """Open one socket after the other, and send all that it takes."""
    for n in itertools.count():
        address = f"{root.replace('http', 'ws')}/_webmap/{name.format(n % 40)}"
        with contextlib.suppress(OSError, WebSocketException, TimeoutError):
            async with connect(
                address, origin=root, subprotocols=["webmap", key], open_timeout=5
            ) as link:
                for message in messages(n):
                    await link.send(message)
                    await asyncio.sleep(0.01)
        await asyncio.sleep(0.02)


def commands(n):
    """Return commands and garbage for the gate; no STOP, which everybody may send."""
    for op in ("take", "drive", "reset", "goal", "cancel", "grant", "locate", "ask"):
        yield json.dumps({"op": op, "robot": f"r{n}", "epoch": n, "seq": n, "tick": n})
    yield from CORPUS
    yield "x" * 100_000


def events(n):
    """Return messages for the model: texts, events, and messages of modules."""
    yield HELLO
    for number, kind in itertools.product(range(40), ("event", "module", "view")):
        message = {"type": kind, "instance": number, "element": number, "value": n}
        yield json.dumps(message)
    yield from CORPUS
    yield "[" * 16_000


async def main(url):
    root = url.partition("/?")[0]
    keys = [await asyncio.to_thread(sign_in, url) for _ in range(2)]
    os.nice(19)  # not before: on a busy machine, the start would take long
    print("ready", flush=True)
    await asyncio.gather(
        *(flood(root, key, "drive?id=d{}", commands) for key in keys),
        *(flood(root, key, "scene?page=/&id=s{}", events) for key in keys),
        *(flood(root, key, "scene?page=/&id=t{}", lambda n: [HELLO]) for key in keys),
    )


def end_with_input():
    sys.stdin.read()
    os._exit(0)


if __name__ == "__main__":
    threading.Thread(target=end_with_input, daemon=True).start()
    asyncio.run(main(sys.argv[1]))
