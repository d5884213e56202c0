"""Large messages are decoded in small steps and in turns, without blocking."""

import asyncio
import json
import resource
import time

import cbor2
import pytest
from test_ros_limits import publish, transforms

from equipment.waiting import until
from webmap.features.layers.diagnostics import DiagnosticArrayMsg
from webmap.features.layers.marker_drawing import MarkerArrayMsg
from webmap.ros import offload, worker
from webmap.ros.foxglove.messages import FoxgloveMessage
from webmap.ros.foxglove.protocol import PAYLOAD
from webmap.ros.messages import OccupancyGridMsg, PathMsg, TFMessage
from webmap.ros.offload import Offload
from webmap.ros.rosbridge.events import Publish
from webmap.ros.serialized.schemas import read_schema
from webmap.ros.serialized.writer import make_writer
from webmap.ros.tf.buffer import names_of

pytestmark = pytest.mark.slow

STEP = 0.1
"""The limit of processor time for a step, in seconds: five times a usual step."""


def run(scenario):
    try:
        asyncio.run(scenario())
        assert offload._shared is None
    finally:
        offload._shared = None  # for the next test


def take(aside, message, view, got, **options):
    def then(_):
        got.append(read(message))

    aside.decode(message, frozenset([view]), then, **options)

    def read(message):
        return message.decode(view)


def poses(count):
    pose = (
        '{"header":{"frame_id":"map"},"pose":{"position":{"x":%d,"y":2,"z":0},'
        '"orientation":{"x":0,"y":0,"z":0,"w":1}}}'
    )
    text = ",".join(pose % number for number in range(count))
    return publish('{"header":{},"poses":[' + text + "]}", "/plan")


def statuses(count):
    each = '{"name":"p%d","level":0,"values":[]}'
    text = ",".join(each % number for number in range(count))
    pad = ',{"name":"' + "x" * offload.LARGE + '","level":0}'
    return publish('{"status":[' + text + pad + "]}", "/diagnostics")


def markers(count):
    marker = {
        "header": {"frame_id": "map"},
        "ns": "a",
        "type": 1,
        "action": 0,
        "pose": {
            "position": {"x": 1.0, "y": 2.0, "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        },
        "scale": {"x": 1.0, "y": 1.0, "z": 1.0},
        "color": {"r": 1.0, "g": 0.0, "b": 0.0, "a": 1.0},
        "points": [],
        "colors": [],
    }
    each = [json.dumps({**marker, "id": number}) for number in range(count)]
    return publish('{"markers":[' + ",".join(each) + "]}", "/markers")


LONG = {
    TFMessage: ("transforms", "/t", transforms(9000)),
    MarkerArrayMsg: ("markers", "/markers", markers(8000)),
    DiagnosticArrayMsg: ("status", "/diagnostics", statuses(1900)),
    PathMsg: ("poses", "/plan", poses(16000)),
}


@pytest.mark.slow
@pytest.mark.parametrize("view", LONG, ids=lambda view: view.__name__)
def test_a_long_message_is_decoded_completely_and_in_order(view):
    field, topic, frame = LONG[view]
    assert len(frame) > offload.LARGE

    async def scenario():
        aside, got = Offload(), []
        message = Publish(topic, frame)
        take(aside, message, view, got)
        whole = Publish(topic, frame).decode(view)
        await until(lambda: topic not in aside._waiting)
        items = [item for part in got for item in getattr(part, field)]
        assert items == getattr(whole, field)
        most = max(len(getattr(part, field)) for part in got)
        if getattr(view, "separable", False):
            assert most <= worker.PIECE
            # A later subscriber gets the whole message and not the last part.
            assert not message.is_decoded(view)
        else:
            assert len(got) == 1
        await aside.stop()

    run(scenario)


def test_a_long_serialized_message_comes_in_parts():
    name = "tf2_msgs/TFMessage"
    transforms = [{"child_frame_id": f"link {each}"} for each in range(9000)]
    data = make_writer(read_schema(name, "ros2msg"), "cdr")({"transforms": transforms})
    message = FoxgloveMessage("/tf", bytes(PAYLOAD) + data, name, "cdr", None, None)
    request = worker.WorkRequest(
        len(message.frame),
        "/tf",
        worker.view_name(FoxgloveMessage),
        worker.view_name(TFMessage),
        arguments=list(message.arguments),
    )
    result, parts = worker.answer(request, message.frame)
    assert len(parts) > 3
    found = [*offload.values(result, [bytearray(each) for each in parts], TFMessage)]
    rows = [row for part in found for row in part.rows]
    assert rows == message.decode(TFMessage).rows
    assert [names_of(row)[1] for row in rows] == [f"link {n}" for n in range(9000)]


@pytest.mark.slow
@pytest.mark.parametrize("view", LONG, ids=lambda view: view.__name__)
def test_no_decoding_step_of_a_long_message_blocks_the_event_loop(view):
    """Measure the steps of all tasks of this thread in processor time.

    A busy processor is slower, so the best of three rounds counts: a step that is
    too long is too long in each round.
    """
    _, topic, frame = LONG[view]

    async def longest():
        aside, got, steps = Offload(), [], []
        take(aside, Publish("/warm", frame.replace(topic.encode(), b"/warm")), view, [])
        await until(lambda: not aside._waiting)

        async def tick():
            while True:
                before = time.thread_time()
                await asyncio.sleep(0.001)
                steps.append(time.thread_time() - before)

        ticking = asyncio.create_task(tick())
        take(aside, Publish(topic, frame), view, got)
        await until(lambda: got and topic not in aside._waiting)
        ticking.cancel()
        await aside.stop()
        return max(steps)

    async def scenario():
        rounds = []
        while len(rounds) < 3 and not (rounds and rounds[-1] < STEP / 5):
            rounds.append(await longest())
        assert min(rounds) < STEP / 5, rounds

    run(scenario)


def test_a_newer_message_cancels_the_remaining_parts_of_an_older_one():
    async def scenario():
        aside, got = Offload(), []

        def newer(_):
            got.append("old")
            if got == ["old"] * 3:
                take(aside, Publish("/t", transforms(3)), TFMessage, got)

        old = Publish("/t", transforms(9000))
        aside.decode(old, frozenset([TFMessage]), newer)
        await until(lambda: not aside._waiting)
        assert got[:3] == ["old"] * 3
        (new,) = got[3:]
        assert len(new.transforms) == 3
        await aside.stop()

    run(scenario)


def test_a_path_published_faster_than_decoding_is_still_delivered():
    async def scenario():
        aside, got = Offload(), []

        async def publish():
            while True:
                take(aside, Publish("/plan", poses(4000)), PathMsg, got)
                await asyncio.sleep(0.01)

        publishing = asyncio.create_task(publish())
        await until(lambda: got)
        publishing.cancel()
        assert len(got[0].poses) == 4000
        await aside.stop()

    run(scenario)


def test_no_static_transform_is_dropped_when_newer_messages_arrive():
    async def scenario():
        aside, got = Offload(), []
        for count in (5000, 3, 4000):
            frame = transforms(count).replace(b'"/t"', b'"/r1/tf_static"')
            take(aside, Publish("/r1/tf_static", frame), TFMessage, got, counts=True)
        await until(lambda: not aside._waiting)
        assert sum(len(part.transforms) for part in got) == 9003
        await aside.stop()

    run(scenario)


@pytest.mark.serial  # the delay is measured
def test_many_large_messages_of_one_bridge_do_not_delay_another_bridge():
    """Many topics of one bridge wait, and then a message of another bridge arrives."""

    async def scenario():
        greedy, other, order = Offload(), Offload(), []

        def note(name):
            return lambda _: order.append(name)

        for number in range(12):
            name = f"/plan{number}"
            frame = poses(3000).replace(b'"/plan"', f'"{name}"'.encode())
            greedy.decode(Publish(name, frame), frozenset([PathMsg]), note("greedy"))
        await until(lambda: order)
        plan, before = Publish("/plan", poses(3000)), len(order)
        other.decode(plan, frozenset([PathMsg]), note("other"))
        await until(lambda: "other" in order)
        assert order.index("other") <= before + 2
        await greedy.stop()
        await other.stop()

    run(scenario)


def test_after_its_pause_a_bridge_decodes_only_the_newest_message(monkeypatch):
    async def scenario():
        aside, got = Offload(), []
        take(aside, Publish("/plan", poses(3000)), PathMsg, got)
        await until(lambda: got)
        aside._rests_until = time.monotonic() + 0.4
        began = time.monotonic()
        take(aside, Publish("/plan", poses(3001)), PathMsg, got)
        await asyncio.sleep(0.05)
        take(aside, Publish("/plan", poses(3002)), PathMsg, got)  # newest
        await until(lambda: len(got) == 2)
        assert time.monotonic() - began > 0.35
        assert len(got[1].poses) == 3002
        await aside.stop()

    run(scenario)


def test_decoding_a_large_map_does_not_block_the_event_loop():
    side = 4000
    op = {"op": "publish", "topic": "/map"}
    origin = {
        "position": {"x": 0.0, "y": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    }
    info = {"resolution": 0.05, "width": side, "height": side, "origin": origin}
    data = cbor2.CBORTag(72, bytes(side * side))
    frame = cbor2.dumps({**op, "msg": {"header": {}, "info": info, "data": data}})

    async def scenario():
        aside, got, steps = Offload(), [], []

        async def tick():
            while True:
                before = time.thread_time()
                await asyncio.sleep(0.001)
                steps.append(time.thread_time() - before)

        ticking = asyncio.create_task(tick())
        take(aside, Publish("/map", frame), OccupancyGridMsg, got)
        await until(lambda: got)
        ticking.cancel()
        assert got[0].cells.shape == (side, side)
        assert max(steps) < STEP
        await aside.stop()

    run(scenario)


@pytest.mark.skipif(not hasattr(resource, "prlimit"), reason="only Linux has prlimit")
def test_the_memory_of_the_worker_is_limited():
    async def scenario():
        aside, got = Offload(), []
        take(aside, Publish("/t", transforms(3000)), TFMessage, got)
        await until(lambda: got)
        pid = offload._shared._process.pid
        bounds = resource.prlimit(pid, resource.RLIMIT_DATA)
        assert bounds == (worker.MEMORY, worker.MEMORY)
        await aside.stop()

    run(scenario)


def test_the_worker_reports_a_message_that_needs_too_much_memory(monkeypatch):
    def decode(self, view):
        raise MemoryError

    monkeypatch.setattr(Publish, "decode", decode)
    reply, parts = worker.answer(
        worker.WorkRequest(2, "/t", worker.view_name(Publish)), b"{}"
    )
    assert reply.error == "it takes too much memory to be decoded"
    assert not parts
