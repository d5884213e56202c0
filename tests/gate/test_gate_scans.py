"""Scans as a bridge sends them, for scan assist."""

import contextlib
import json
import math
from array import array

import cbor2
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from equipment.captured_frames import frame_file
from webmap.base.errors import ProtocolError
from webmap.gate.lanes.scans import parse_scan, subscribe


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_a_recorded_scan_keeps_infinite_and_nan_ranges_apart(dialect):
    frame = frame_file(dialect, "cbor_scan_inf_nan.bin").read_bytes()
    topic, sweep = parse_scan(frame, 5.0)
    assert topic.endswith("base_scan")
    assert any(map(math.isnan, sweep.ranges))
    assert any(map(math.isinf, sweep.ranges))
    assert sweep.arrived == 5.0
    assert sweep.angle_increment > 0


def test_a_scan_subscription_asks_for_cbor_and_a_queue_of_one():
    asked = json.loads(subscribe("/scan", "x"))
    assert asked["compression"] == "cbor"
    assert asked["queue_length"] == 1
    assert asked["type"] == "sensor_msgs/LaserScan"


def scan(**changed):
    numbers = cbor2.CBORTag(85, array("f", [1.0, 2.0]).tobytes())
    message = {
        "angle_min": 0.0,
        "angle_increment": 0.1,
        "range_min": 0.1,
        "range_max": 8.0,
        "ranges": numbers,
        **changed,
    }
    return cbor2.dumps({"op": "publish", "topic": "/scan", "msg": message})


def test_a_scan_is_parsed():
    topic, sweep = parse_scan(scan(), 1.0)
    assert (topic, sweep.ranges) == ("/scan", [1.0, 2.0])


@pytest.mark.parametrize(
    ("header", "frame"),
    [
        ({"frame_id": "laser"}, "laser"),
        ({"frame_id": "/laser"}, "laser"),
        ({"frame_id": "x" * 5000}, "x" * 80),
        ({"frame_id": 7}, ""),
        ({}, ""),
        (7, ""),
        (None, ""),
    ],
)
def test_the_frame_of_a_scan_comes_from_its_header(header, frame):
    assert parse_scan(scan(header=header), 1.0)[1].frame == frame


def test_a_dense_scan_keeps_its_frame():
    numbers = cbor2.CBORTag(85, array("f", [1.0] * 2000).tobytes())
    dense = scan(header={"frame_id": "laser"}, ranges=numbers, angle_increment=0.001)
    sweep = parse_scan(dense, 1.0)[1]
    assert (sweep.frame, len(sweep.ranges) <= 720) == ("laser", True)


@pytest.mark.parametrize(
    "frame",
    [
        b'{"op":"publish","topic":"/scan","msg":{"ranges":[null]}}',
        cbor2.dumps({"op": "status"}),
        cbor2.dumps({"op": "publish", "topic": "/scan", "msg": 3}),
        scan(angle_min="0"),
        scan(range_max=None),
        scan(ranges=["far"]),
        scan(ranges=[None]),
    ],
)
def test_invalid_scan_messages_are_ignored(frame):
    assert parse_scan(frame, 1.0) is None


def test_missing_ranges_are_parsed_as_an_empty_list():
    assert parse_scan(scan(ranges=None), 1.0)[1].ranges == []


@given(st.binary(max_size=200))
@example(b"\xa0[\x80" + bytes(7))  # a byte string that claims 2**63 bytes
def test_arbitrary_bytes_raise_only_protocol_errors(frame):
    with contextlib.suppress(ProtocolError):
        parse_scan(frame, 1.0)
