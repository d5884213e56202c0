"""Rosbridges that send a much too large message once a second."""

import asyncio
import base64
import io
import json
import random
import struct

import cbor2
from safety_hostile_peers import BINARY, TEXT, frame

PERIOD = 1.0
"""Seconds between two messages."""

HEADER = '{"stamp":{"sec":1,"nanosec":0},"frame_id":"map"}'
POSE = (
    '{"position":{"x":1.5,"y":2.5,"z":0.0},'
    '"orientation":{"x":0.0,"y":0.0,"z":0.0,"w":1.0}}'
)
TRANSFORM = (
    '{"header":%s,"child_frame_id":"f%d","transform":{"translation":{"x":1,"y":2,'
    '"z":0},"rotation":{"x":0,"y":0,"z":0,"w":1}}}'
)
MARKER = (
    '{"header":%s,"ns":"a","id":%d,"type":1,"action":0,"pose":' + POSE + ",\n"
    '"scale":{"x":1,"y":1,"z":1},"color":{"r":1,"g":0,"b":0,"a":1},"points":[],'
    '"colors":[],"text":"","lifetime":{"sec":0,"nanosec":0},"frame_locked":false}'
)
STATUS = (
    '{"level":0,"name":"part %d","message":"ok","values":[{"key":"a","value":"b"}]}'
)


def publish(topic, text):
    return [f'{{"op":"publish","topic":"{topic}","msg":{text}}}'.encode()]


def path(count):
    each = f'{{"header":{HEADER},"pose":{POSE}}}'
    poses = ",".join([each] * count)
    return publish("/plan", f'{{"header":{HEADER},"poses":[{poses}]}}')


def transforms(count):
    each = ",".join(TRANSFORM % (HEADER, number) for number in range(count))
    return publish("/tf", f'{{"transforms":[{each}]}}')


def markers(count):
    each = ",".join(MARKER % (HEADER, number) for number in range(count))
    return publish("/markers", f'{{"markers":[{each}]}}')


def diagnostics(count):
    each = ",".join(STATUS % number for number in range(count))
    return publish("/diagnostics", f'{{"header":{HEADER},"status":[{each}]}}')


def log_line(size):
    text = "x" * size
    return publish("/rosout", f'{{"level":40,"name":"n","msg":"{text}"}}')


def in_cbor(topic, message):
    message["header"] = {"frame_id": "map", "stamp": {"secs": 1, "nsecs": 0}}
    return [cbor2.dumps({"op": "publish", "topic": topic, "msg": message})]


def grid(width, height):
    noise = (
        random.Random(1)
        .randbytes(1 << 16)
        .translate(bytes(i % 101 for i in range(256)))
    )
    cells = (noise * (1 + width * height // len(noise)))[: width * height]
    origin = json.loads(POSE)
    info = {"resolution": 0.05, "width": width, "height": height, "origin": origin}
    return in_cbor("/map", {"info": info, "data": cbor2.CBORTag(72, cells)})


def cloud(count):
    fields = [
        {"name": name, "offset": 4 * number, "datatype": 7, "count": 1}
        for number, name in enumerate("xyz")
    ]
    some = [random.Random(1).uniform(-20, 20) for _ in range(4 * 1000)]
    return in_cbor(
        "/points",
        {
            "height": 1,
            "width": count,
            "fields": fields,
            "point_step": 16,
            "row_step": 16 * count,
            "is_bigendian": False,
            "data": struct.pack("<4000f", *some) * (count // 1000),
        },
    )


def picture(width, height):
    return in_cbor(
        "/camera/image_raw",
        {
            "height": height,
            "width": width,
            "encoding": "rgb8",
            "is_bigendian": 0,
            "step": 3 * width,
            "data": random.Random(1).randbytes(3 * width) * height,
        },
    )


def empty_lists(count):
    """Return an answer without a request, and a message, with only empty lists."""
    lists = "[]," * count + "[]"
    answer = f'{{"op":"service_response","service":"/x","values":[{lists}]}}'
    head = cbor2.dumps({"op": "publish", "topic": "/map", "msg": 0})[:-1]
    items = head + b"\x9a" + struct.pack(">I", 10 * count) + b"\x80" * 10 * count
    return [answer.encode(), items]


def in_fragments(count):
    text = path(count)[0].decode()
    size = len(text) // 50 + 1
    return [
        json.dumps(
            {
                "op": "fragment",
                "id": "1",
                "num": number,
                "total": -(-len(text) // size),
                "data": text[number * size : (number + 1) * size],
            }
        ).encode()
        for number in range(-(-len(text) // size))
    ]


def png_bombs(side):
    """Return two compressed pictures that are small until they are unpacked."""
    from PIL import Image

    file = io.BytesIO()
    Image.new("RGB", (side, side)).save(file, "PNG")
    data = base64.b64encode(file.getvalue()).decode()
    wrapped = json.dumps({"op": "png", "data": data}).encode()
    image = json.dumps({"header": json.loads(HEADER), "format": "png", "data": data})
    return [wrapped, *publish("/camera/image_raw/compressed", image)]


def peer(make, *arguments):
    """Return a peer that sends messages after the client subscribes to /diagnostics."""

    async def talk(link):
        await link.accept()
        while (await link.receive()).get("topic") != "/diagnostics":
            pass
        reading = asyncio.create_task(read_on(link))
        frames = [
            frame(TEXT if text.startswith(b"{") else BINARY, text)
            for text in make(*arguments)
        ]
        try:
            while True:
                for data in frames:
                    await link.write(data)
                await asyncio.sleep(PERIOD)
        finally:
            reading.cancel()

    async def read_on(link):
        while True:
            await link.receive()  # reading also answers pings

    return talk


huge_diagnostics = peer(diagnostics, 200_000)
huge_path = peer(path, 100_000)
huge_transforms = peer(transforms, 100_000)
huge_markers = peer(markers, 100_000)

long_diagnostics = peer(diagnostics, 1_900)
long_path = peer(path, 16_000)
long_transforms = peer(transforms, 9_900)
long_markers = peer(markers, 9_900)

large_map = peer(grid, 8000, 7500)
large_cloud = peer(cloud, 3_900_000)
large_picture = peer(picture, 4000, 4000)

long_line = peer(log_line, 16 << 20)
many_lists = peer(empty_lists, 5_000_000)
fragments = peer(in_fragments, 100_000)
bombs = peer(png_bombs, 8000)
