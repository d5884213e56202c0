"""The size of a message is checked before the message is decoded."""

import asyncio
import json
import struct
import tracemalloc
from pathlib import Path

import cbor2
import pytest

from equipment.fake_rosbridge import bridged
from equipment.waiting import until
from webmap.base.scope import Scope
from webmap.ros import limits, worker
from webmap.ros.limits import (
    GENERAL,
    LIMITS,
    MAX_VALUES,
    TooLarge,
    limit_of,
)
from webmap.ros.messages import TFMessage
from webmap.ros.rosbridge.events import (
    MAX_ITEMS,
    MAX_NUMBERS,
    MAX_OTHER,
    Malformed,
    Publish,
    check_count,
)
from webmap.ros.rosbridge.protocol import Protocol
from webmap.ros.sockets.frame_reader import SHORTENED

MIB = 1 << 20


@pytest.mark.parametrize(
    ("type", "mib"),
    [
        (None, 4),
        ("nav_msgs/Path", 4),
        ("some_robot/msg/Anything", 4),
        ("nav_msgs/OccupancyGrid", 64),
        ("nav_msgs/msg/OccupancyGrid", 64),
        ("sensor_msgs/msg/PointCloud2", 64),
        ("sensor_msgs/Image", 64),
        ("sensor_msgs/msg/CompressedImage", 8),
    ],
)
def test_the_size_limit_depends_on_the_type_in_both_dialects(type, mib):
    assert limit_of(type).size == mib * MIB


def test_type_limits_are_between_the_general_limit_and_the_frame_limit():
    assert all(limit.size <= limits.MAX_FRAME for limit in LIMITS.values())
    assert all(limit.size > GENERAL.size for limit in LIMITS.values())


def publish(text, topic="/t"):
    return f'{{"op":"publish","topic":"{topic}","msg":{text}}}'.encode()


def test_a_too_large_message_is_reported_to_its_subscriber_and_logged_once(caplog):
    text = json.dumps({"data": "x" * (5 * MIB)})

    async def scenario():
        got, reported, mended = [], [], []
        scope = Scope("page", lambda text, about: reported.append(text), mended.append)
        async with bridged() as (server, bridge):
            with scope.active():
                bridge.subscribe("/t", got.append, "std_msgs/String")
            for _ in range(3):
                await server.send(publish(text).decode())
            await until(lambda: bridge.stats.frames >= 3)
            await until(lambda: reported)
            assert got == []
            assert reported == [
                "/t: got a message of 5.0 MiB; std_msgs/String may have 4 MiB: publish "
                "less at a time, or on several topics"
            ]
            await server.send(publish('{"data":"small"}').decode())
            await until(lambda: got)
            assert len(mended) == 1
            scope.close()

    asyncio.run(scenario())
    lines = [r for r in caplog.records if "got a message of" in r.getMessage()]
    assert len(lines) == 1


@pytest.mark.slow
@pytest.mark.parametrize("binary", [False, True])
def test_a_map_of_any_size_costs_neither_the_connection_nor_memory(binary, caplog):
    """Such a map is latched: the bridge would send it again on each new connection."""
    cells = b"0," * (40 * MIB)
    text = b'{"op":"publish","topic":"/map","msg":{"data":[' + cells + b"0]}}"
    if binary:
        map = {"info": {}, "data": cbor2.CBORTag(72, cells)}
        text = cbor2.dumps({"op": "publish", "topic": "/map", "msg": map})
    large = text if binary else text.decode()
    del text, cells

    async def scenario():
        got, reported, maps = [], [], []
        scope = Scope("page", lambda text, about: reported.append(text), lambda _: None)
        async with bridged() as (server, bridge):
            with scope.active():
                bridge.subscribe("/map", maps.append, "nav_msgs/OccupancyGrid")
                bridge.subscribe("/odom", got.append, "nav_msgs/Odometry")
            for number in range(2):
                await server.send(large)
                await server.send('{"op":"publish","topic":"/odom","msg":{"n":1}}')
                await until(lambda number=number: len(got) > number)
            await until(lambda: reported)
            assert reported == [
                "/map: got a message of 80.0 MiB; nav_msgs/OccupancyGrid may have "
                "64 MiB: publish a coarser map, or a part of it"
            ]
            assert bridge.stats.links == 1
            assert bridge.stats.bytes < 10_000
            assert maps == []
            scope.close()

    asyncio.run(scenario())
    assert caplog.text.count("got a message of") == 1


def test_a_message_that_only_looks_shortened_is_refused():
    for size in (0, 5, limits.MAX_FRAME):
        frame = SHORTENED + size.to_bytes(8, "big") + publish('{"data":1}')
        assert isinstance(Protocol().receive(frame, 0.0), Malformed)
    size = limits.MAX_FRAME + 1
    frame = SHORTENED + size.to_bytes(8, "big") + b'{"op":"call_service"'
    event = Protocol().receive(frame, 0.0)
    assert isinstance(event, Malformed)
    assert event.reason == "a frame of 67108865 bytes, at most 67108864"


def test_the_value_limit_counts_objects_and_lists_but_not_texts():
    check_count(publish('{"a":[' + "[]," * (MAX_VALUES - 10) + "1]}"))
    check_count(publish('{"a":"' + r"{[\"{\\" * MAX_VALUES + '"}'))
    check_count(publish('{"a":[' + "1," * MAX_VALUES * 3 + "1]}"))
    for many in ('{"a":[' + "{}," * MAX_VALUES + "1]}", "[" * (MAX_VALUES + 9)):
        with pytest.raises(TooLarge, match=f"the limit is {MAX_VALUES}"):
            check_count(publish(many))


def test_all_items_of_a_cbor_message_are_counted():
    op = {"op": "publish", "topic": "/t"}
    check_count(cbor2.dumps({**op, "msg": {"data": b"\x80" * 5 * MIB, "n": [1.5, -7]}}))
    check_count(cbor2.dumps({**op, "msg": cbor2.CBORTag(72, b"\x80" * 5 * MIB)}))
    check_count(b"\xa1\x5f\x41a\xff\x01")  # a text in pieces
    check_count(b"\xbf\xff\xa1")  # the decoder refuses bytes that are cut off
    head = cbor2.dumps({**op, "msg": 0})[:-1]
    with pytest.raises(TooLarge, match="objects and lists"):
        check_count(head + b"\x9b" + struct.pack(">Q", 1 << 60) + b"\x80" * MAX_VALUES)
    with pytest.raises(TooLarge, match="items of CBOR"):
        check_count(head + b"\x9a" + struct.pack(">I", MAX_ITEMS) + b"\x00" * MAX_ITEMS)


@pytest.mark.parametrize(
    "make",
    [  # slow to make, so each is made when its test runs
        lambda: publish('{"transforms":[' + "[]," * 10 * MAX_VALUES + "1]}"),
        lambda: cbor2.dumps(
            {"op": "publish", "topic": "/t", "msg": [[]] * 10 * MAX_VALUES}
        ),
    ],
    ids=["json", "cbor"],
)
def test_the_worker_refuses_too_many_values_before_building_them(make):
    frame = make()
    asked = worker.WorkRequest(len(frame), "/t", worker.view_name(Publish))
    tracemalloc.start()
    try:
        reply, _ = worker.answer(asked, frame)
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert reply.kind == "TooLarge"
    assert "the limit is" in reply.error
    assert most < 3 * len(frame)  # the counted copy has no texts


def transforms(count):
    each = (
        '{"child_frame_id":"f%d","transform":{"translation":{"x":1,"y":2,"z":0},'
        '"rotation":{"x":0,"y":0,"z":0,"w":1}}}'
    )
    text = ",".join(each % number for number in range(count))
    return publish('{"transforms":[' + text + "]}")


def test_a_message_with_too_many_transforms_is_refused():
    frame = transforms(10_001)
    view = worker.view_name(TFMessage)
    asked = worker.WorkRequest(len(frame), "/t", worker.view_name(Publish), view)
    reply, _ = worker.answer(asked, frame)
    assert reply.error.startswith("got a message with 10001 transforms; the limit is")


@pytest.mark.parametrize("start", ['{"a":[', '{"msg":{"data":['])
def test_a_large_frame_that_does_not_start_as_a_message_is_refused(start):
    frame = start + "[]," * (MAX_OTHER // 3) + "[]]"
    event = Protocol().receive(frame + ',"topic":"/t","op":"publish"}', 0.0)
    assert isinstance(event, Malformed)
    assert "4.0 MiB that does not begin as a message on a topic" in event.reason


def test_a_service_response_with_too_many_values_is_refused():
    frame = '{"op":"service_response","values":[' + "[]," * MAX_VALUES + "1]}"
    event = Protocol().receive(frame, 0.0)
    assert isinstance(event, Malformed)
    assert "objects and lists" in event.reason
    slow = '{"op":"service_response","values":[NaN' + ",1" * MAX_NUMBERS + "]}"
    assert "NaN" in Protocol().receive(slow, 0.0).reason
    quick = slow.replace("NaN", "1")
    assert len(Protocol().receive(quick, 0.0).values) == MAX_NUMBERS + 1


def test_a_fragmented_message_may_be_as_large_as_an_unfragmented_one():
    text = publish(json.dumps({"data": "é" * 3 * MIB})).decode()
    pieces = [text[at : at + MIB] for at in range(0, len(text), MIB)]
    protocol = Protocol()
    for number, data in enumerate(pieces):
        part = {"op": "fragment", "id": "1", "num": number, "total": len(pieces)}
        event = protocol.receive(json.dumps({**part, "data": data}), 0.0)
    assert isinstance(event, Publish)
    assert event.decode()["data"] == "é" * 3 * MIB


def test_the_size_of_fragments_is_counted_in_bytes_not_characters():
    part = {"op": "fragment", "id": "1", "total": 50, "data": "\U0001f600" * (MIB // 2)}
    protocol, events = Protocol(), []
    for number in range(40):
        text = json.dumps({**part, "num": number}, ensure_ascii=False)
        events.append(protocol.receive(text, 0.0))
    assert any(isinstance(event, Malformed) for event in events)


PARTS = (
    "objects and lists in one message; in CDR and in the serialization of ROS 1, also "
    "strings in lists"
)


def test_the_documented_limits_match_the_code():
    page = Path(__file__).parents[2] / "docs/reference/limits.md"
    rows = [line.split("|")[1:-1] for line in page.read_text().splitlines()]
    received = {
        row[0].strip(): [cell.strip() for cell in row[1:]] for row in rows if row
    }
    for name, limit in LIMITS.items():
        (row,) = (cells for what, cells in received.items() if f"`{name}`" in what)
        assert row == [str(limit.size // MIB), limit.why]
    other = received["every other type, and a topic without a type"]
    assert other == [str(GENERAL.size // MIB), GENERAL.why]
    for field, (most, why) in limits.ITEMS.items():
        (row,) = (cells for what, cells in received.items() if f"`{field}`" in what)
        assert row == [f"{most:,}", why]
    assert received[PARTS][0] == f"{MAX_VALUES:,}"
