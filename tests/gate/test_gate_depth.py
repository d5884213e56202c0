"""Data that is nested deeply or has very many values is refused and logged."""

import asyncio
import struct

import cbor2
import pytest
from link_bench import TEXT, Received, frame, in_loop, raw_bridge

from equipment.waiting import until
from webmap.base.errors import ProtocolError
from webmap.gate import pipe, protocol
from webmap.gate.actions import SendGoal
from webmap.gate.events import Key
from webmap.gate.lanes import navigation, rosbridge, scans
from webmap.gate.lanes.budget import Budget
from webmap.gate.lanes.sockets import SocketHandlers, open_socket

DEPTH = 12_000
"""Deeper than Python follows, which is 10,000 levels since 3.12."""

DEEP = [
    b'{"op":"x","a":' + b"[" * DEPTH,
    b'{"op":"x","a":' + b"[" * DEPTH + b"]" * DEPTH + b"}",
    b'{"op":"x","a":' + b'{"a":' * DEPTH + b"1" + b"}" * (DEPTH + 1),
]
GOAL = SendGoal(
    Key("ws://r", "/cmd_vel"), "r1", "g1", "navigate_to_pose", 0, 0, 0, "A", 9
)
READERS = {
    "words": rosbridge.parse,
    "answers": lambda data: navigation.answer_to(data, "a"),
    "navigation": lambda data: navigation.of_action(data, GOAL),
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("data", DEEP, ids=["open", "lists", "objects"])
def test_data_nested_too_deeply_is_refused_with_a_reason(reader, data):
    with pytest.raises(ProtocolError, match="nested deeper than 32 levels"):
        READERS[reader](data)


@pytest.mark.parametrize("reader", READERS)
def test_data_with_too_many_values_is_refused_before_decoding(reader):
    data = b'{"op":"x","a":[' + b"[]," * 300_000 + b"[]]}"
    with pytest.raises(ProtocolError, match="of about 600004 values was sent where"):
        READERS[reader](data)


def test_a_dense_scan_in_json_is_read():
    ranges = b",".join([b"1.25"] * 7200)
    data = b'{"op":"publish","topic":"/s","msg":{"ranges":[' + ranges + b"]}}"
    assert rosbridge.parse(data).topic == "/s"


def test_data_nested_20_levels_deep_is_read():
    data = b'{"op":"x","a":' + b"[" * 20 + b"]" * 20 + b"}"
    assert rosbridge.plain(data)["op"] == "x"


def scan(ranges):
    """Return a scan as CBOR with some bytes for its ranges."""
    head = cbor2.dumps({"op": "publish", "topic": "/scan"})
    return (
        b"\xa3"
        + head[1:]
        + cbor2.dumps("msg")
        + b"\xa1"
        + cbor2.dumps("ranges")
        + ranges
    )


def list_of(count, each):
    return b"\x9a" + struct.pack(">I", count) + each * count


@pytest.mark.parametrize(
    "ranges",
    [
        list_of(100_000, b"\x80"),
        list_of(1001, b"\x61a"),
        list_of(300_000, b"\x00"),
        b"\x9f" + b"\x00" * 300_000 + b"\xff",
        b"\xba" + struct.pack(">I", 260_000) + b"\x00" * 520_000,
    ],
    ids=["lists", "texts", "numbers", "endless", "pairs"],
)
def test_a_scan_of_many_parts_is_refused_before_it_is_decoded(ranges):
    with pytest.raises(ProtocolError, match="more than 1000 lists, maps and texts"):
        scans.parse_scan(scan(ranges), 0.0)


def test_a_scan_that_nests_too_deeply_is_refused():
    with pytest.raises(ProtocolError, match="not CBOR"):
        scans.parse_scan(scan(b"\x81" * 900 + b"\x00"), 0.0)


@pytest.mark.parametrize(
    "ranges",
    [
        list_of(100_000, b"\xfb" + struct.pack(">d", 1.5)),
        list_of(200_000, b"\xfa" + struct.pack(">f", 1.5)),
        list_of(50_000, b"\xfb" + struct.pack(">d", 1.5) + b"\xf9\x7c\x00"),
        cbor2.dumps(cbor2.CBORTag(85, struct.pack("<3600f", *[1.5] * 3600))),
        cbor2.dumps(cbor2.CBORTag(85, b"\0" * 1_000_000)),
    ],
    ids=["doubles", "singles", "mixed", "typed", "longest typed"],
)
def test_a_scan_of_many_numbers_is_accepted(ranges):
    scans.check_parts(scan(ranges))


def test_deeply_nested_data_on_the_pipe_is_logged_and_skipped(caplog):
    body = b"\x82\xa4type\xa1x" + b"\x91" * 100_000 + b"\xc0"
    good = pipe.pack(protocol.Heartbeat())
    for deep in (b"\x91" * 100_000, b"\x81\xa1x" * 100_000, body):
        framed = struct.pack("<I", len(deep)) + deep
        assert len(pipe.Unpacker(protocol.ToGate).feed(framed + good)) == 1
    assert "not a message on the gate's pipe" in caplog.text
    assert "Traceback" not in caplog.text


@in_loop
async def test_a_link_with_deeply_nested_messages_stays_open_and_logs_once(caplog):
    received = Received()

    def receive(data):
        rosbridge.parse(data)
        received.texts.append(data)

    async def talk(link):
        deep = DEEP[0]
        head = b"\x81\x7e" + len(deep).to_bytes(2, "big")
        await link.accept((head + deep) * 3 + frame(TEXT, b"{}"))
        await link.reader.read()

    async with raw_bridge(talk) as url:
        handlers = SocketHandlers(receive, received.pongs.append, received.lost.append)
        link = await open_socket(url, handlers, Budget())
        await until(lambda: received.texts == [b"{}"], "the next message")
        await asyncio.sleep(0)
        assert link.is_open
        link.close()
    assert caplog.text.count("a message nested deeper than 32 levels") == 1
    assert "Traceback" not in caplog.text
