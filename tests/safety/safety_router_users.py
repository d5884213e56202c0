"""Hostile users of a router, each a function that sends arbitrary samples.

``python safety_router_users.py NAME ROUTER URL`` acts as the user of the environment
variables ``WEBMAP_ROUTER_...`` until standard input ends. ``bay4`` is the user of an
agent, ``east`` the user of displays that may only look at the robot of bay 3. URL is
the address of the page, with which a viewer is signed in.
"""

import asyncio
import itertools
import json
import os
import re
import secrets
import sys
import threading
import time
import zlib
from urllib.parse import urlsplit

import msgspec
from safety_crowd import sign_in
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException

from webmap.agents import address
from webmap.agents.announcements import PROTOCOL, Beacon
from webmap.agents.data_messages import DICTIONARY, FRAME, PACKED
from webmap.agents.gate_messages import Numbering, PageState, SampleAck, ToDisplays
from webmap.agents.peer import Peer
from webmap.agents.router_access import RouterUser
from webmap.core.motion import id_at_agent

BOB = "Bob (bay3)"
"""The robot that an operator drives."""

encode = msgspec.msgpack.encode


def bridge_of(name):
    topics = {"odometry": {"topic": "/odom"}, "twist": {"topic": "/cmd_vel"}}
    return {"bridge": "ws://127.0.0.1:1", "name": name, **topics}


def describe(peer, about):
    """Act as the agent bay 4, with a description that changes twice a second."""
    peer.answer(address.about("bay4"), about)
    for number in itertools.count():
        beacon = Beacon(PROTOCOL, "hostile", f"{number}")
        peer.put_data(address.beacon("bay4"), msgspec.json.encode(beacon))
        yield number
        time.sleep(0.5)


def about(robots):
    bridges = ["ws://127.0.0.1:1"]
    return json.dumps({"bridges": bridges, "robots": robots, "grids": []}).encode()


def another_robots_identity(peer, _url):
    """Describe a robot under the name and the identities of a robot of bay 3."""
    identity = id_at_agent("bay3", "Bob")
    robots = [
        {"id": identity, "config": bridge_of("Bob"), **bridge_of(name)}
        for name in ("Bob", BOB, "bay3/Bob", "../bay3/Bob", identity)
    ]
    robots += [bridge_of(each["name"]) for each in robots]
    for _ in describe(peer, lambda: about(robots)):
        pass


def many_robots(peer, _url):
    """Describe 3,000 robots, others each time."""
    count = itertools.count()

    def answer():
        turn = next(count)
        return about([bridge_of(f"r{turn}-{n}") for n in range(3000)])

    for _ in describe(peer, answer):
        pass


def large_description(peer, _url):
    """Describe robots with 20 MB."""
    large = about([bridge_of("x" * 20_000_000)])
    for _ in describe(peer, lambda: large):
        pass


def deep_description(peer, _url):
    """Describe a robot with lists nested 100,000 deep."""
    deep = about([]).replace(b"[]", b"[" * 100_000 + b"]" * 100_000)
    for _ in describe(peer, lambda: deep):
        pass


def reports_of_others(peer, _url):
    """Send all that a gate sends, about the robot of bay 3 and about each page."""
    identities = [id_at_agent("bay3", "Bob"), id_at_agent("bay4", "a")]
    seen = set()

    def hear(_key, sample):
        seen.update(re.findall(rb"(?:west|anyone)\.[0-9a-f]+/[0-9a-z-]+", sample))
        identities.extend(
            each.decode()
            for each in re.findall(rb'"robot":"([^"]+)"', sample)
            if each.decode() not in identities
        )

    for name in ("bay3", "bay4"):
        key = address.gate_in(name, address.EVERY, address.EVERY)
        peer.listen(key, hear, gate=True)
        peer.listen(address.gate_out(name), hear, gate=True)
    numbering = Numbering()
    for _ in describe(peer, lambda: about([bridge_of("a")])):
        pages = [each.decode() for each in seen] or ["west.1/1"]
        for kind in msgspec.inspect.type_info(ToDisplays).types:
            for page in pages[:20]:
                fields = {each.name: value(each.type, page) for each in kind.fields}
                if "robot" not in fields:
                    send(peer, numbering, kind.cls(**fields))
                    continue
                for robot in identities[:10]:
                    send(peer, numbering, kind.cls(**{**fields, "robot": robot}))


def value(kind, page):
    """Return a value of a type; each text names a page."""
    inspect = msgspec.inspect
    match kind:
        case inspect.StrType():
            return page
        case inspect.BoolType():
            return True
        case inspect.IntType() | inspect.FloatType():
            return 1
        case inspect.LiteralType(values):
            return values[0]
        case inspect.UnionType(types) if any(
            isinstance(each, inspect.NoneType) for each in types
        ):
            return None
        case inspect.UnionType(types):
            return value(types[0], page)
        case inspect.DictType():
            return {page: 1}
        case inspect.VarTupleType():
            return () if "Struct" in type(kind.item_type).__name__ else (page,)
        case inspect.TupleType(items):
            return tuple(value(item, page) for item in items)
        case inspect.StructType(cls):
            return cls(**{each.name: value(each.type, page) for each in kind.fields})
    return ()


def send(peer, numbering, message):
    peer.put_gate(address.gate_out("bay4"), numbering.next(encode(message)))


def many_displays(peer, _url):
    """Send as 140 displays with two pages each, again and again."""
    numberings = [Numbering() for _ in range(140)]
    while True:
        for number, numbering in enumerate(numberings):
            key = address.gate_in("bay3", "east", f"{number:08x}")
            pages = tuple(PageState(page, "x", "operator") for page in ("1", "2"))
            peer.put_gate(key, numbering.next(encode(SampleAck(1, 1, pages))))
        time.sleep(0.5)


def large_samples(peer, _url):
    """Send samples of 1 MiB on the lane of the gate."""
    numbering = Numbering()
    key = address.gate_in("bay3", "east", "1")
    while True:
        peer.put_gate(key, numbering.next(b"\x81" * ((1 << 20) - 16)))
        time.sleep(0.02)


def many_samples(peer, _url):
    """Send small samples on the lane of the gate, as fast as the link takes them."""
    numbering = Numbering()
    key = address.gate_in("bay3", "east", "1")
    while True:
        for _ in range(200):
            peer.put_gate(key, numbering.next(b"\x81\xa2op\xa4none"))
        time.sleep(0.01)


def bombs(peer, _url):
    """Send frames of 60 kB that unpack to 60 MB, and frames of 4 MB."""
    packing = zlib.compressobj(9, zdict=DICTIONARY)
    bomb = PACKED + packing.compress(b" " * 60_000_000) + packing.flush()
    large = FRAME + b" " * 4_000_000
    for number in itertools.count():
        for piece in (bomb, large):
            peer.put_data(address.data_in("bay3", "east", "1", f"{number % 20}"), piece)
        time.sleep(0.02)


def other_subscriptions(peer, _url):
    """Subscribe to the topics of the robot with other types and compressions."""
    kinds = itertools.cycle([("png", "x/Y"), ("cbor-raw", "nav_msgs/Path"), ("no", "")])
    while True:
        compression, type = next(kinds)
        for topic in ("/odom", "/cmd_vel", "/scan", "/tf"):
            op(
                peer,
                op="subscribe",
                topic=topic,
                type=type,
                compression=compression,
                throttle_rate=100_000,
                id=compression,
            )
        time.sleep(0.2)


def calls(peer, _url):
    """Call what a bridge answers slowly, or never."""
    for number in itertools.count():
        for name in ("message_details", "service_request_details", "nodes", "topics"):
            op(
                peer,
                op="call_service",
                service=f"/rosapi/{name}",
                id=f"{number}",
                args={"type": "x/Y", "depth": number},
            )
        time.sleep(0.005)


def op(peer, **fields):
    piece = FRAME + json.dumps(fields).encode()
    peer.put_data(address.data_in("bay3", "east", "1", "1"), piece, all=True)


def pages_of_a_viewer(_peer, url):
    """Open pages and the sockets of pages, and close most of them at once."""
    asyncio.run(open_pages(url))


async def open_pages(url):
    key, place = sign_in(url), urlsplit(url).netloc

    async def again(path, stay):
        for number in itertools.count():
            name = f"v{number % 10:03d}{secrets.token_hex(4)}"
            try:
                async with connect(
                    f"ws://{place}/_webmap/{path}?page=%2F&id={name}",
                    origin=f"http://{place}",
                    subprotocols=["webmap", key],
                    compression=None,
                    max_size=None,
                ) as socket:
                    if path == "scene":
                        size = {"width": 800, "height": 600, "containers": {}}
                        hello = {"op": "hello", "page": name, "url": "/", **size}
                        await socket.send(json.dumps(hello))
                    await asyncio.sleep(stay)
            except (OSError, WebSocketException, TimeoutError):
                await asyncio.sleep(0.05)

    await asyncio.gather(
        *(again("drive", 5.0) for _ in range(120)),
        *(again("scene", 0.02) for _ in range(20)),
    )


def main():
    """Act as a user until standard input ends."""
    os.nice(19)
    name, router, url = sys.argv[1:]
    peer = Peer(router, RouterUser.from_environment())
    peer.start()
    while not peer.connected:
        time.sleep(0.05)
    print("ready", flush=True)
    threading.Thread(target=globals()[name], args=(peer, url), daemon=True).start()
    sys.stdin.read()
    os._exit(0)


if __name__ == "__main__":
    main()
