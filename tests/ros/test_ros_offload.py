import asyncio
import os
import signal
import sys
from array import array
from collections import deque

import cbor2
import msgspec
import pytest

from equipment.captured_frames import CAPTURED
from equipment.fake_rosbridge import bridged
from equipment.waiting import until
from webmap.base.errors import ProtocolError
from webmap.ros import offload, worker
from webmap.ros.bridge import Bridge
from webmap.ros.decoding import decode_json
from webmap.ros.messages import LaserScanMsg, OccupancyGridMsg
from webmap.ros.offload import Offload
from webmap.ros.received_message import ReceivedMessage
from webmap.ros.rosbridge.events import Publish

MAP = (CAPTURED / "ros2/publish_map.ros2.json").read_bytes()


class Grid(msgspec.Struct):
    data: list[int]


HEADER = {"stamp": {"sec": 1, "nanosec": 0}, "frame_id": "map"}
ORIGIN = {
    "position": {"x": 0.0, "y": 0.0, "z": 0.0},
    "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
}


def run(scenario):
    try:
        asyncio.run(scenario())
        assert offload._shared is None
    finally:
        offload._shared = None  # for the next test


def large(data="x"):
    padding = "y" * offload.LARGE
    frame = f'{{"op":"publish","topic":"/a","msg":{{"data":"{data}","p":"{padding}"}}}}'
    return Publish("/a", frame.encode())


async def decoded(message, *types):
    aside, done = Offload(), asyncio.Event()
    assert aside.is_needed(message)
    aside.decode(message, frozenset(types), lambda _: done.set())
    await done.wait()
    await aside.stop()


@pytest.mark.parametrize("view", [None, OccupancyGridMsg, Grid])
def test_the_worker_decodes_a_large_message_to_the_same_value(view):
    async def scenario():
        here, there = Publish("/map", MAP), Publish("/map", MAP)
        await decoded(there, view)
        assert there.is_decoded(view)
        assert there.decode(view) == here.decode(view)

    run(scenario)


class OwnMessage(ReceivedMessage):
    """A message of a link that is not part of WebMap: JSON without a head."""

    def check_count(self) -> None:
        pass

    def _decode(self, type):
        return decode_json(self.frame, type or dict)


def own(text="y" * offload.LARGE):
    return OwnMessage("/a", msgspec.json.encode({"text": text}))


def test_the_worker_decodes_the_messages_of_a_link_outside_of_webmap(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))

    async def scenario():
        message = own()
        await decoded(message, None)
        assert message.decode() == own().decode()

    run(scenario)


def test_a_link_whose_message_class_the_worker_cannot_import_gets_advice(monkeypatch):
    monkeypatch.delenv("PYTHONPATH", raising=False)

    async def scenario():
        message = own()
        await decoded(message, None)
        with pytest.raises(ProtocolError, match="install the package of this link"):
            message.decode()

    run(scenario)


@pytest.mark.skipif(os.name != "posix", reason="only POSIX has nice")
def test_the_decoding_worker_runs_at_low_priority():
    async def scenario():
        aside, done = Offload(), asyncio.Event()
        aside.decode(large(), frozenset({None}), lambda _: done.set())
        await done.wait()
        pid = offload._shared._process.pid
        assert os.getpriority(os.PRIO_PROCESS, pid) == min(19, os.nice(0) + 10)
        await aside.stop()

    run(scenario)


def test_the_worker_reports_the_missing_field_of_a_wrong_type():
    async def scenario():
        message = Publish("/map", MAP)
        await decoded(message, LaserScanMsg)
        with pytest.raises(ProtocolError, match="angle_min"):
            message.decode(LaserScanMsg)

    run(scenario)


@pytest.mark.parametrize("view", [None, LaserScanMsg])
def test_typed_arrays_survive_the_transfer_through_the_worker(view, monkeypatch):
    monkeypatch.setattr(offload, "LARGE", 1000)
    frame = (CAPTURED / "ros1/cbor_scan_inf_nan.bin").read_bytes()

    async def scenario():
        there = Publish("/robot_0/base_scan", frame)
        await decoded(there, view)
        scan = there.decode(view)
        values = scan["ranges"] if view is None else scan.range_values.values
        assert len(values) == 720
        assert values.typecode == "f"

    run(scenario)


def test_a_broken_large_frame_is_an_error_and_the_worker_keeps_running():
    async def scenario():
        aside, done = Offload(), []
        broken, good = Publish("/map", MAP[:-100]), large()
        for message in (broken, good):
            aside.decode(
                message, frozenset([None]), lambda _, m=message: done.append(m)
            )
        await until(lambda: done == [broken, good])
        with pytest.raises(ProtocolError, match="not JSON"):
            broken.decode()
        assert good.decode()["data"] == "x"
        process = offload._shared._process
        assert process.returncode is None
        await aside.stop()
        assert process.returncode is not None

    run(scenario)


def test_a_killed_worker_is_replaced_for_the_next_message():
    async def scenario():
        aside, done = Offload(), asyncio.Event()
        first = large()
        aside.decode(first, frozenset([None]), lambda _: done.set())
        await until(lambda: offload._shared and offload._shared._process)
        os.kill(offload._shared._process.pid, signal.SIGKILL)
        await done.wait()
        done.clear()
        second = large()
        aside.decode(second, frozenset([None]), lambda _: done.set())
        await done.wait()
        assert second.decode()["data"] == "x"
        await aside.stop()

    run(scenario)


def test_a_newer_message_replaces_a_waiting_one_and_the_order_is_kept():
    async def scenario():
        aside, got = Offload(), []
        small = Publish("/a", b'{"op":"publish","topic":"/a","msg":{"data":"last"}}')
        for message in (large("1"), large("2"), large("3"), small):
            assert aside.is_needed(message)
            aside.decode(
                message,
                frozenset([None]),
                lambda _, m=message: got.append(m.decode()["data"]),
            )
        await until(lambda: got[-1:] == ["last"])
        assert got == ["1", "last"]
        assert not aside.is_needed(small)
        await aside.stop()

    run(scenario)


@pytest.mark.parametrize(
    ("type", "came"),
    [
        ("visualization_msgs/MarkerArray", ["1", "2", "3", "last"]),
        ("map_msgs/msg/OccupancyGridUpdate", ["1", "2", "3", "last"]),
        ("nav_msgs/Path", ["1", "last"]),
    ],
)
def test_no_message_that_changes_earlier_ones_is_replaced_by_a_newer_one(type, came):
    async def scenario():
        bridge, got = Bridge("ws://127.0.0.1:9"), []  # it is not connected
        bridge.subscribe("/a", lambda message: got.append(message["data"]), type)
        small = Publish("/a", b'{"op":"publish","topic":"/a","msg":{"data":"last"}}')
        for message in (large("1"), large("2"), large("3"), small):
            bridge._received(bridge._topics["/a"], message)
        await until(lambda: got[-1:] == ["last"])
        assert got == came
        await bridge.stop()

    run(scenario)


def test_of_many_changes_that_wait_for_the_decoding_the_newest_are_kept(monkeypatch):
    waiting = deque()
    for number in range(20):
        offload._join(waiting, offload._Job(large(str(number)), frozenset(), (), True))
    assert len(waiting) == offload.MOST_WAITING
    assert waiting[-1].message.decode()["data"] == "19"
    monkeypatch.setattr(offload, "MAX_FRAME", 3 * offload.LARGE)
    offload._join(waiting, offload._Job(large("20"), frozenset(), (), True))
    assert [each.message.decode()["data"] for each in waiting] == ["19", "20"]


def test_two_callbacks_for_one_message_are_both_called():
    async def scenario():
        aside, got = Offload(), []
        message = large()
        aside.decode(large(), frozenset([None]), lambda _: got.append(0))
        aside.decode(message, frozenset([None]), lambda _: got.append(1))
        aside.decode(message, frozenset([None]), lambda _: got.append(2))
        await until(lambda: len(got) == 3)
        assert got == [0, 1, 2]
        await aside.stop()

    run(scenario)


def test_a_bridge_decodes_a_large_map_in_a_worker_and_ends_the_worker(caplog):
    async def scenario():
        got = []
        async with bridged() as (server, bridge):
            bridge.subscribe("/map", got.append, decode=OccupancyGridMsg)
            await server.send(MAP.decode())
            await until(lambda: got)
            assert got[0].cells.shape == (320, 400)
            process = offload._shared._process
            assert process.returncode is None
        assert process.returncode is not None

    run(scenario)
    assert "lost" not in caplog.text


def test_stopping_during_decoding_ends_the_shared_worker():
    async def scenario():
        aside = Offload()
        aside.decode(large(), frozenset([None]), print)
        await until(lambda: offload._shared and offload._shared._process)
        await aside.stop()

    run(scenario)


def test_only_webmap_types_have_a_view_name_for_the_worker():
    assert worker.view_name(OccupancyGridMsg) == "webmap.ros.messages:OccupancyGridMsg"
    assert worker.view_name(Grid) is None
    assert worker.view_name(None) is None


def test_the_worker_answers_a_broken_frame_with_an_error():
    for frame in (b"", b"{", b"\xa1\xff", b"[" * 10000):
        reply, parts = worker.answer(worker.WorkRequest(len(frame), "/a"), frame)
        assert reply.error
        assert not parts


def test_large_arrays_of_an_answer_are_not_copied_and_small_ones_do_not_keep_it():
    def answered(count: int):
        info = {"resolution": 0.05, "width": count, "height": 1, "origin": ORIGIN}
        grid = {
            "header": HEADER,
            "info": info,
            "data": cbor2.CBORTag(72, b"\7" * count),
        }
        data = cbor2.dumps({"op": "publish", "topic": "/map", "msg": grid})
        view = worker.view_name(OccupancyGridMsg)
        request = worker.WorkRequest(len(data), "/map", worker.view_name(Publish), view)
        answer, parts = worker.answer(request, data)
        parts = [bytearray(part) for part in parts]
        (message,) = offload.values(answer, parts, OccupancyGridMsg)
        return message.data, parts

    cells, parts = answered(2 << 20)
    assert cells.values.obj is parts[0]
    assert cells.array()[-1] == 7
    assert not cells.array().flags.writeable, "other subscribers share the array"
    cells, _ = answered(1000)
    assert isinstance(cells.values, array)
    assert bytes(cells) == b"\7" * 1000


def test_an_answer_takes_memory_only_for_bytes_that_have_come():
    async def scenario():
        stream = asyncio.StreamReader()
        stream.feed_data(b"abc")
        stream.feed_eof()
        with pytest.raises(EOFError):
            await offload._read(stream, 1 << 50)  # far more than any machine has

    asyncio.run(scenario())
