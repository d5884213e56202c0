"""Scans as a bridge sends them, for scan assist."""

import contextlib
import json
import math
from array import array

import cbor2
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from captured_frames import frame_file
from webmap.base.errors import ProtocolError
from webmap.gate.lanes.odometry import parse_scan, subscribe


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_a_real_bridge_s_scan_keeps_nothing_apart_from_unknown(dialect):
    frame = frame_file(dialect, "cbor_scan_inf_nan.bin").read_bytes()
    topic, sweep = parse_scan(frame, 5.0)
    assert topic.endswith("base_scan")
    assert any(map(math.isnan, sweep.ranges))
    assert any(map(math.isinf, sweep.ranges))
    assert sweep.arrived == 5.0
    assert sweep.angle_increment > 0


def test_scans_are_asked_for_in_cbor_and_the_newest_only():
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


def test_a_scan_is_read():
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
def test_the_frame_of_a_scan_is_what_its_header_says(header, frame):
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
def test_anything_else_is_no_scan(frame):
    assert parse_scan(frame, 1.0) is None


def test_a_scan_without_ranges_is_empty():
    assert parse_scan(scan(ranges=None), 1.0)[1].ranges == []


@given(st.binary(max_size=200))
@example(b"\xa0[\x80" + bytes(7))  # a byte string that claims 2**63 bytes
def test_no_bytes_do_any_harm(frame):
    with contextlib.suppress(ProtocolError):
        parse_scan(frame, 1.0)
