"""The processor time of a message in each form in which a link receives it.

Each contender decodes the same messages into the same views: from the JSON and the CBOR
of a rosbridge, and from the serialized bytes of ROS 2 and ROS 1, which other links and
recordings have. Then the same messages are sent over each link at the rates of a robot,
to a Bridge and to a bare client of websockets at once: both get the same bytes in the
same seconds, each in a process of its own.
"""

import json
import math
import os
import random
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from typing import Any

import cbor2
import msgspec
import numpy as np

from benchmarks import harness
from benchmarks.frames import VARIANTS, odometry, scan
from benchmarks.harness import Comparison, Contender, Figures, compare, percentile
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
        *(received(link, title, rounds, quick=quick) for link, title in LINKS.items()),
    ]


LINKS = {
    "json": "Odometry at 50 Hz, scans at 10 and frames at 20 by a rosbridge, in JSON",
    "cbor": "The same by a rosbridge, in CBOR",
    "cdr": "The same by a Foxglove bridge, in CDR",
}


def received(link: str, title: str, rounds: int, *, quick: bool) -> Comparison:
    """Compare a Bridge with websockets alone, which both receive the same messages."""
    comparison = Comparison(title, {"websockets alone": [], "webmap": []})
    begun = time.monotonic()
    for number in range(rounds):
        took = time.monotonic() - begun
        if number and took + took / number > harness.MOST_SECONDS:
            break
        print(f"{title}: round {number + 1}", file=sys.stderr)
        for runs, figures in zip(
            comparison.runs.values(),
            _received(link, 2.0 if quick else 7.0),
            strict=True,
        ):
            runs.append(figures)
    return comparison


def _received(link: str, seconds: float) -> list[Figures]:
    """Return the figures of the bare client and of the Bridge."""
    python = [sys.executable, "-m"]
    with ExitStack() as running:

        def start(name: str, *arguments: object) -> "subprocess.Popen[str]":
            command = [*python, f"benchmarks.{name}", *map(str, arguments)]
            started = running.enter_context(
                subprocess.Popen(
                    command,
                    stdout=subprocess.PIPE,
                    text=True,
                    env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
                )
            )
            running.callback(started.terminate)
            return started

        server = start("link_server", link, seconds)
        assert server.stdout is not None
        url = server.stdout.readline().strip()
        clients = [
            start("link_listener", client, link, url, seconds)
            for client in ("bare", "webmap")
        ]
        sent = json.loads(server.stdout.readline())
        answers = [json.loads(client.communicate()[0]) for client in clients]
    return [_figures(sent, answer) for answer in answers]


def _figures(sent: dict[str, dict[str, float]], answer: dict[str, Any]) -> Figures:
    delays = [
        1000 * (at - sent[topic][number])
        for topic, times in answer["got"].items()
        for number, at in times.items()
    ]
    return {
        "cpu a message (us)": answer["cpu"] * 1e6,
        "time, 50 % (ms)": percentile(delays, 50),
        "time, 99 % (ms)": percentile(delays, 99),
        "messages": len(delays),
    }


def _contenders(type: str, *, quick: bool, stored: bool = False) -> list[Contender]:
    view, make = MESSAGES[type]
    made = [make(number) for number in range(VARIANTS)]
    times = 4 if quick else 40
    found = {}
    for name, packed in (("JSON", as_json), ("CBOR", as_cbor)):
        frames = [packed(message) for message in made]
        decode = partial(_decode, view)
        found[name] = _decoding(decode, frames, stored=stored)
    for name, encoding, language in _SERIALIZED:
        schema = read_schema(type, language)
        write, read = make_writer(schema, encoding), make_reader(schema, view, encoding)
        frames = [write(whole(message, encoding)) for message in made]
        found[name] = _decoding(read, frames, stored=stored)
    return [
        Contender(name, partial(_measured, run, times)) for name, run in found.items()
    ]


_SERIALIZED: tuple[tuple[str, Encoding, SchemaEncoding], ...] = (
    ("CDR", "cdr", "ros2msg"),
    ("ROS 1", "ros1", "ros1msg"),
)


def as_json(message: dict[str, Any], topic: str = TOPIC) -> bytes:
    """Return the frame of a rosbridge in JSON."""
    publish = {"op": "publish", "topic": topic, "msg": message}
    return json.dumps(publish, separators=(",", ":")).encode()


def as_cbor(message: dict[str, Any], topic: str = TOPIC) -> bytes:
    """Return the frame of a rosbridge in CBOR."""
    if "ranges" in message:
        ranges = np.array(message["ranges"], "<f4").tobytes()  # NaN for None
        message = {**message, "ranges": cbor2.CBORTag(85, ranges)}
    return cbor2.dumps({"op": "publish", "topic": topic, "msg": message})


def whole(message: dict[str, Any], encoding: Encoding) -> dict[str, Any]:
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
