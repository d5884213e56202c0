"""A STOP that is not a valid command stops robots, too (S10)."""

import json

import pytest

from equipment.gate_harness import Bench, spec
from webmap.gate import protocol
from webmap.gate.commands import Stop, begins_like_stop, robot_in, stop_in

START = b'{"op":"stop"'


@pytest.mark.parametrize(
    "frame",
    [
        START,
        START + b"}",
        b' \t\r\n{ "op"\n:\t"stop" , ',
        START + b"\xff\xfe",
        START + b"[" * 5000,
        START + b"x" * 5000,
    ],
)
def test_a_message_that_begins_like_a_stop_is_recognized(frame):
    assert begins_like_stop(frame)


@pytest.mark.parametrize(
    "frame",
    [
        b"",
        b'{"op":"sto',
        b'{"op":"stop-test"}',
        b'{"op":"stop2"',
        b'{"op":"drive","robot":"r1"}',
        b'{"robot":"r1","op":"stop",}',
        b'[{"op":"stop"}]',
        b'\x0b{"op":"stop"',
        b"stop",
    ],
)
def test_a_message_that_does_not_begin_like_a_stop_is_not_recognized(frame):
    assert not begins_like_stop(frame)


@pytest.mark.parametrize(
    ("rest", "robot"),
    [
        (b',"robot":"r1"}', "r1"),
        (b' , "robot" :\t"r1" , "why":1}', "r1"),
        (b',"why":1,"robot":"r1"}', "r1"),
        (b',"robot":"r1"', "r1"),
        (b',"robot":"r1",', "r1"),
        (b',"robot":"r1","x":' + b"[" * 5000, "r1"),
        (b',"robot":"r1","x":"\xff"}', "r1"),
        (b',"robot":"r\\u0031"', "r1"),
        (b',"x":NaN,"robot":"r1"}', "r1"),
        (b',"robot":"r1"}}', "r1"),
        (b',"robot":"r1"}' + b" " * 2000 + b"{", "r1"),
        (b"}", None),
        (b"", None),
        (b',"robot":"r1', None),
        (b',"robot":"r\\', None),
        (b',"robot":"\\x"', None),
        (b',"robot":"\xff"', None),
        (b',"robot":1}', None),
        (b',"robot":["r1"]}', None),
        (b',"robot":"r1","robot":"r2"}', None),
        (b',"robot":"r1","robot" : "r2"', None),
        (b',"x":{"robot":"r1"}}', None),
        (b',"x":{"robot":"r1"}', None),
        (b',"x":1,"robot":"r1"', None),
        (b',"x":' + b"1" * 5000 + b"}", None),
    ],
)
def test_the_robot_of_a_malformed_stop_is_read_only_if_it_is_unambiguous(rest, robot):
    assert robot_in(START + rest) == robot


@pytest.mark.parametrize(
    "frame", [b"5", b"null", b"true", b'"robot"', b"[5]", b"[[1, 2, 3]]", b"{}", b""]
)
def test_a_frame_that_is_no_object_names_no_robot(frame):
    assert robot_in(frame) is None


@pytest.mark.parametrize(
    ("frame", "stop"),
    [
        (b'{"op":"stop","robot":"r1"}', Stop("r1")),
        (b'{"robot":"r1","op":"stop"}', Stop("r1")),
        (b'{"robot":"*","op":"stop"}', Stop(None)),
        (b'{"op":"stop","robot":"r1","why":1}', Stop("r1")),
        (b'{"op":"stop"', Stop(None)),
        (b'{"op":"take","robot":"r1"}', None),
        (b'{"robot":"r1","op":"stop","why":1}', None),
        (b"5", None),
    ],
)
def test_the_stop_in_a_frame(frame, stop):
    assert stop_in(frame) == stop


@pytest.fixture
def two():
    """A page that drives one of two robots."""
    bench = Bench().begin(spec(), spec(id="r2", twist_topic="/r2/cmd_vel"))
    bench.drive_off()
    return bench


def send(bench, data, who="b"):
    bench.handle(protocol.FromPage(who, data))


NAMES_ONE = [
    b'{"op":"stop","robot":"r1","why":"fire"}',
    b'{"op":"stop","robot":"r1"',
    b'{"op":"stop","robot":"r1","x":"\xff"}',
    b'{"op":"stop","robot":"r1","x":' + b"[" * 900,
    b'{"op":"stop","robot":"r1","x":"' + b"x" * 1024 + b'"}',
]
NAMES_NONE = [
    b'{"op":"stop"',
    b'{"op":"stop"}',
    b'{"op":"stop","robot":7}',
    b'{"op":"stop","robot":"r9"}',
    b'{"op":"stop","robot":"r9"',
    b'{"op":"stop","robot":""}',
    b'{"op":"stop","robot":"r1","robot":"r2"}',
    b' {\n"op" : "stop" \xff',
    b'{"op":"stop","x":"' + b"x" * 2000,
]


@pytest.mark.parametrize("frame", NAMES_ONE, ids=range(len(NAMES_ONE)))
def test_a_malformed_stop_stops_the_robot_that_it_names(two, frame):
    send(two, frame)
    assert two.written[-1].twist.is_zero
    assert (two.report("r1").latched, two.report("r2").latched) == (True, False)
    (refused,) = two.refusals("b")
    assert (refused.robot, refused.what) == (None, "stop")
    assert refused.why.startswith("this STOP is not valid (")
    assert refused.why.endswith("): STOP is active for 'r1'")


@pytest.mark.parametrize("frame", NAMES_NONE, ids=range(len(NAMES_NONE)))
def test_a_malformed_stop_without_a_known_robot_stops_all_robots(two, frame):
    send(two, frame)
    assert two.report("r1").latched
    assert two.report("r2").latched
    assert two.refusals("b")[-1].why.endswith("): STOP is active for all robots")
    at = two.now
    two.hold(1.0, x=1.0)
    assert [w for w in two.moving_since(at) if w.at > at] == []


def test_a_malformed_stop_counts_from_a_viewer_but_not_from_an_unknown_page(two):
    send(two, b'{"op":"stop"', "nobody")
    assert not two.report("r1").latched
    two.join("v", "viewer")
    send(two, b'{"op":"stop"', "v")
    assert two.report("r1").latched


def test_a_malformed_stop_is_executed_before_the_page_is_closed_for_garbage(two):
    for _ in range(19):
        send(two, b"{")
    assert two.of(protocol.CloseConnection) == []
    send(two, b'{"op":"stop"')
    assert two.of(protocol.CloseConnection)
    sent = [
        message
        for message in two.messages
        if isinstance(message, protocol.CloseConnection)
        or (isinstance(message, protocol.SentTwist) and message.by is None)
    ]
    assert isinstance(sent[-1], protocol.CloseConnection), "zero is sent first"
    assert two.report("r1").latched
    two.run(1.1)
    send(two, b'{"op":"stop"', "b")
    assert two.report("r2").latched, "a STOP of a page that is being closed counts"


def test_a_malformed_stop_does_not_keep_the_dead_man_of_another_robot_alive(two):
    since = two.now
    frame = b'{"op":"stop","robot":"r2",'
    two.run(0.5, lambda: send(two, frame, "a"))
    assert two.moving_since(since + 0.2101) == []
    assert not two.report("r1").latched


def test_invalid_messages_other_than_stop_do_not_stop_a_robot(two):
    for frame in (b'{"op":"stop-test","x":1}', b'{"op":"sto', b'{"op":"drive"'):
        send(two, frame)
    assert not two.report("r1").latched
    assert {refused.what for refused in two.refusals("b")} == {"command"}


def test_a_valid_stop_does_not_count_as_garbage(two):
    for _ in range(30):
        send(two, json.dumps({"op": "stop", "robot": "r1"}).encode())
    assert two.of(protocol.CloseConnection) == []
    assert two.refusals("b") == []
