"""The processor time of a message in each form in which a link receives it.

Each contender decodes the same messages into the same views: from the JSON and the CBOR
of a rosbridge, and from the serialized bytes of ROS 2 and ROS 1, which other links and
recordings have. Nothing is sent here.
"""

import json
import math
import random
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import cbor2
import msgspec
import numpy as np

from benchmarks.frames import VARIANTS, odometry, scan
from benchmarks.harness import Comparison, Contender, Figures, compare
from webmap.ros.messages import LaserScanMsg, OdometryMsg, TFMessage
from webmap.ros.rosbridge.events import Publish
from webmap.ros.serialized.reader import make_reader
from webmap.ros.serialized.schemas import Encoding, SchemaEncoding, read_schema
from webmap.ros.serialized.writer import make_writer
from webmap.ros.tf import Buffer

FRAMES = "tf2_msgs/TFMessage"
TOPIC = "/robot_0/topic"
TRANSFORMS = 50


def transforms(number: int) -> dict[str, Any]:
    """Return one ``tf2_msgs/TFMessage``: a chain of links, all with one stamp."""
    chance = random.Random(number)
    stamp = {
        "secs": 1_700_000_000 + number // 20,
        "nsecs": number % 20 * 50_000_000 + 372_882,
    }
    found = []
    for link in range(TRANSFORMS):
        turn = {axis: chance.uniform(0.1, 1.0) for axis in "xyzw"}
        norm = math.hypot(*turn.values())
        found.append(
            {
                "header": {"stamp": stamp, "frame_id": f"robot_0/link_{link}"},
                "child_frame_id": f"robot_0/link_{link + 1}",
                "transform": {
                    "translation": {axis: chance.random() for axis in "xyz"},
                    "rotation": {axis: part / norm for axis, part in turn.items()},
                },
            }
        )
    return {"transforms": found}


MESSAGES: dict[str, tuple[type[msgspec.Struct], Callable[[int], dict[str, Any]]]] = {
    "nav_msgs/Odometry": (OdometryMsg, odometry),
    "sensor_msgs/LaserScan": (LaserScanMsg, scan),
    FRAMES: (TFMessage, transforms),
}
"""The view of each type, and what makes its messages."""


def bench(*, rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare the forms, for each type in turn."""
    return [
        *(
            compare(f"One {type} into its view", _contenders(type, quick=quick), rounds)
            for type in MESSAGES
        ),
        compare(
            f"One {FRAMES} into the buffer of frames",
            _contenders(FRAMES, stored=True, quick=quick),
            rounds,
        ),
    ]


def _contenders(type: str, *, quick: bool, stored: bool = False) -> list[Contender]:
    view, make = MESSAGES[type]
    made = [make(number) for number in range(VARIANTS)]
    times = 4 if quick else 40
    found = {}
    for name, packed in (("JSON", _json), ("CBOR", _cbor)):
        frames = [packed(message) for message in made]
        decode = partial(_decode, view)
        found[name] = _decoding(decode, frames, stored=stored)
    for name, encoding, language in _SERIALIZED:
        schema = read_schema(type, language)
        write, read = make_writer(schema, encoding), make_reader(schema, view, encoding)
        frames = [write(_whole(message, encoding)) for message in made]
        found[name] = _decoding(read, frames, stored=stored)
    return [
        Contender(name, partial(_measured, run, times)) for name, run in found.items()
    ]


_SERIALIZED: tuple[tuple[str, Encoding, SchemaEncoding], ...] = (
    ("CDR", "cdr", "ros2msg"),
    ("ROS 1", "ros1", "ros1msg"),
)


def _json(message: dict[str, Any]) -> bytes:
    publish = {"op": "publish", "topic": TOPIC, "msg": message}
    return json.dumps(publish, separators=(",", ":")).encode()


def _cbor(message: dict[str, Any]) -> bytes:
    if "ranges" in message:
        ranges = np.array(message["ranges"], "<f4").tobytes()  # NaN for None
        message = {**message, "ranges": cbor2.CBORTag(85, ranges)}
    return cbor2.dumps({"op": "publish", "topic": TOPIC, "msg": message})


def _whole(message: dict[str, Any], encoding: Encoding) -> dict[str, Any]:
    """Return the message with NaN for no range, and the header of its dialect."""
    message = dict(message)
    if "ranges" in message:
        message["ranges"] = np.array(message["ranges"], "<f4")
    if "header" in message and encoding == "cdr":
        header = message["header"]
        message["header"] = {name: header[name] for name in ("stamp", "frame_id")}
    return message


def _decode(view: type[msgspec.Struct], data: bytes) -> Any:
    return Publish(TOPIC, data).decode(view)


def _decoding(
    decode: Callable[[bytes], Any], frames: Sequence[bytes], *, stored: bool
) -> Callable[[], None]:
    """Return what decodes all frames, and stores their transforms if asked."""

    def run() -> None:
        for frame in frames:
            decode(frame)

    def store() -> None:
        buffer = Buffer()
        for frame in frames:
            for row in decode(frame).rows:
                buffer.add_row(row)

    return store if stored else run


def _measured(decode: Callable[[], None], times: int) -> Figures:
    """Return the processor time of a message: the average, and the cheapest part."""
    parts = []
    for _ in range(times):
        begun = time.process_time()
        decode()
        parts.append((time.process_time() - begun) / VARIANTS * 1e6)
    return {
        "microseconds a message": sum(parts) / times,
        "in the cheapest part": min(parts),
    }
