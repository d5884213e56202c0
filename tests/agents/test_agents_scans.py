"""Scans over an uplink: the distances and angles that remain."""

import json
import math
from pathlib import Path

import cbor2
import pytest

from webmap.agents.data_messages import lean_scan, pack_frame
from webmap.base.errors import WireError
from webmap.ros.rosbridge.cbor import decode

CAPTURED = Path(__file__).parents[1] / "captured"


def scan_of(frame):
    text = frame if isinstance(frame, str) else frame.decode()
    return json.loads(text)["msg"]


def frame(distances, **changes):
    scan = {
        "angle_min": -1.0,
        "angle_max": -1.0 + 0.5 * (len(distances) - 1),
        "angle_increment": 0.5,
        "time_increment": 0.001,
        "range_min": 0.1,
        "range_max": 10.0,
        "ranges": distances,
        "intensities": [1.0] * len(distances),
    }
    return json.dumps(
        {"op": "publish", "topic": "/scan", "msg": scan | changes}
    ).encode()


def test_the_shortest_distance_of_neighbouring_beams_remains():
    scan = scan_of(lean_scan(frame([5.0, 4.0, 3.0, 6.0, 7.0, 2.0]), 3))
    assert scan["ranges"] == [4.0, 3.0, 2.0]
    assert scan["intensities"] == []


def test_a_beam_is_in_the_middle_of_those_that_it_replaces():
    scan = scan_of(lean_scan(frame([1.0] * 6), 3))
    assert scan["angle_min"] == pytest.approx(-0.75)
    assert scan["angle_increment"] == pytest.approx(1.0)
    assert scan["angle_max"] == pytest.approx(1.25)
    assert scan["time_increment"] == pytest.approx(0.002)


def test_a_distance_that_is_none_hides_no_other():
    got = lean_scan(frame([None, 3.0, 0.0, 4.0, None, None]), 3)
    assert scan_of(got)["ranges"] == [3.0, 4.0, None]


def test_a_number_of_beams_that_does_not_divide_the_scan():
    scan = scan_of(lean_scan(frame([5.0, 4.0, 3.0, 2.0, 1.0, 6.0, 7.0]), 3))
    assert scan["ranges"] == [3.0, 1.0, 7.0]


def test_a_scan_with_few_beams_is_not_changed():
    given = frame([1.0, 2.0])
    assert lean_scan(given, 2) is given


@pytest.mark.parametrize("kind", ["ros1", "ros2"])
def test_the_scan_of_a_rosbridge_keeps_its_form(kind):
    given = (CAPTURED / kind / "cbor_scan_inf_nan.bin").read_bytes()
    before, after = decode(given), decode(lean_scan(given, 20))
    assert {**before, "msg": None} == {**after, "msg": None}
    assert before["msg"].keys() == after["msg"].keys()
    assert before["msg"]["header"] == after["msg"]["header"]
    assert len(after["msg"]["ranges"]) <= 20
    least = before["msg"]["range_min"]
    nearest = min(each for each in before["msg"]["ranges"] if each >= least)
    assert min(after["msg"]["ranges"]) == pytest.approx(nearest, abs=0.5 / 1024)
    assert not any(math.isnan(each) for each in after["msg"]["ranges"])


@pytest.mark.parametrize("kind", ["ros1", "ros2"])
def test_the_distances_of_a_rosbridge_are_rounded_and_need_fewer_bytes(kind):
    given = (CAPTURED / kind / "cbor_scan_inf_nan.bin").read_bytes()
    got = lean_scan(given, None)
    before, after = decode(given)["msg"], decode(got)["msg"]
    for one, other in zip(before["ranges"], after["ranges"], strict=True):
        assert other == pytest.approx(one, abs=0.5 / 1024, nan_ok=True)
    assert {**before, "ranges": 0} == {**after, "ranges": 0}
    assert len(pack_frame(got)) < 0.85 * len(pack_frame(given))


def test_json_without_a_number_of_beams_is_not_changed():
    given = frame([1.00001, 2.0])
    assert lean_scan(given, None) is given


@pytest.mark.parametrize(
    "given",
    [
        b"{",
        b"[]",
        b'{"op":"publish","topic":"/scan"}',
        b'{"op":"publish","topic":"/scan","msg":{"data":[1,2]}}',
        frame([1.0] * 3, ranges=["far", "near", "far"]),
        frame([1.0] * 3, angle_increment=None),
        frame([1.0] * 3, ranges=[[1.0], [2.0, 3.0], []]),
        b"\xa1",
        cbor2.dumps({"op": "publish", "msg": 5}),
    ],
)
def test_a_message_that_is_no_scan_is_refused(given):
    with pytest.raises(WireError, match="no scan"):
        lean_scan(given, 2)
