"""Markers are drawn at the frames that they name."""

import math

import pytest
from module_fakes import pose, to_root
from test_layers_at_stamp import stamp, transform
from test_layers_frames import send_transforms
from test_layers_markers import CUBE, TEXT, marker

from webmap.base.errors import ProtocolError
from webmap.base.geometry import Affine
from webmap.features.layers import markers
from webmap.poses.alignment import align_bridge
from webmap.poses.frames import _shared_frames


@pytest.fixture(autouse=True)
def no_patience(monkeypatch):
    monkeypatch.setattr("webmap.poses.placing.PROBLEM_DELAY", 0.0)
    monkeypatch.setattr("webmap.poses.frames.GRACE", 0.0)


@pytest.fixture
def layer(map, link):
    return map.add_module("Markers", link, "/markers").layer


def cube(number, frame, seconds=0.0, *, locked=False, at=(1.0, 0.0, 0.0)) -> dict:
    return marker(
        CUBE,
        at=at,
        id=number,
        frame_locked=locked,
        header={"stamp": stamp(seconds), "frame_id": frame},
    )


def publish(link, *markers) -> None:
    link.publish("/markers", {"markers": list(markers)})


def drive(link, x, seconds) -> None:
    """A robot that drives along the map's y axis, as its odometry is turned."""
    send_transforms(link, transform("map", "odom", 10.0, 0.0, math.pi / 2, seconds))
    send_transforms(link, transform("odom", "base_link", x, 0.0, 0.0, seconds))


def middle(layer, number) -> tuple[float, float]:
    return to_root(layer.shapes["test", number]).apply(0.0, 0.0)


def test_each_marker_of_an_array_is_placed_by_its_own_frame(link, layer):
    publish(link, cube(9, "odom"))
    drive(link, 5.0, 100.0)
    publish(
        link, cube(1, "map"), cube(2, "odom"), cube(3, "base_link"), cube(4, "/map")
    )
    assert middle(layer, 1) == pytest.approx((1.0, 0.0))
    assert middle(layer, 2) == pytest.approx((10.0, 1.0))
    assert middle(layer, 3) == pytest.approx((10.0, 6.0))
    assert middle(layer, 4) == pytest.approx((1.0, 0.0))
    (box,) = layer.shapes["test", 2].children
    assert to_root(box).apply(1, 0) == pytest.approx((10.0, 2.0)), (
        "the box turns with the robot"
    )


def test_a_frame_locked_marker_moves_with_its_frame_and_others_stay(link, layer):
    publish(link, cube(9, "odom"))
    drive(link, 5.0, 100.0)
    publish(link, cube(1, "base_link", locked=True), cube(2, "base_link"))
    drive(link, 7.0, 101.0)
    assert middle(layer, 1) == pytest.approx((10.0, 8.0))
    assert middle(layer, 2) == pytest.approx((10.0, 6.0))
    publish(link, cube(1, "base_link"))
    drive(link, 9.0, 102.0)
    assert middle(layer, 1) == pytest.approx((10.0, 8.0)), (
        "the marker is not locked any more"
    )


def test_a_marker_is_placed_by_its_frame_at_the_stamp(link, layer):
    publish(link, cube(9, "odom"))
    drive(link, 5.0, 100.0)
    drive(link, 6.0, 100.5)
    publish(link, cube(1, "base_link", 100.25), cube(2, "base_link", 100.75))
    assert middle(layer, 1) == pytest.approx((10.0, 6.5))
    drive(link, 7.0, 101.0)
    assert middle(layer, 2) == pytest.approx((10.0, 7.5)), (
        "corrected when the pose is known"
    )
    drive(link, 9.0, 102.0)
    assert middle(layer, 2) == pytest.approx((10.0, 7.5))


def test_an_unknown_frame_of_a_marker_is_a_problem_until_it_is_known(
    link, layer, channel
):
    publish(link, cube(1, "odom"), cube(2, "map"))
    assert middle(layer, 1) == pytest.approx((1.0, 0.0)), "drawn without its frame"
    (problem,) = layer.problems.values()
    assert "the pose of 'odom' on the map is unknown: there is no frame" in problem
    assert channel.errors == [problem]
    drive(link, 0.0, 100.0)
    assert middle(layer, 1) == pytest.approx((10.0, 1.0))
    assert layer.problems == {}
    drive(link, 0.0, 101.0)
    publish(link, cube(3, "nowhere"))
    assert "'nowhere'" in next(iter(layer.problems.values()))
    publish(link, {**cube(3, "nowhere"), "action": 2})
    assert layer.problems == {}, "a deleted marker needs no frame"


def test_text_markers_are_upright_in_any_frame(link, layer):
    publish(link, cube(9, "odom"))
    drive(link, 5.0, 100.0)
    header = {"stamp": stamp(0), "frame_id": "base_link"}
    publish(link, marker(TEXT, at=(2.0, 0.0, 1.0), text="here", header=header))
    placed = to_root(layer.shapes["test", 1])
    assert placed.apply(0, 0) == pytest.approx((10.0, 7.0))
    assert placed.b == placed.c == 0


def test_frames_are_subscribed_only_when_a_marker_needs_them(map, link):
    before = dict(_shared_frames)
    module = map.add_module("Markers", link, "/markers")
    publish(link, cube(1, "map"), cube(2, ""))
    assert set(link.listeners) == {"/markers"}
    publish(link, cube(1, "odom"))
    assert set(link.listeners) == {"/markers", "/tf", "/tf_static"}
    map.remove_module(module)
    assert link.listeners == {}
    assert _shared_frames == before


def test_markers_without_a_map_frame_ignore_frames(map, link):
    layer = map.add_module("Markers", link, "/markers", map_frame=None).layer
    publish(link, cube(1, "odom"))
    assert set(link.listeners) == {"/markers"}
    assert middle(layer, 1) == pytest.approx((1.0, 0.0))


def test_markers_are_placed_by_the_frames_of_their_namespace(map, link):
    layer = map.add_module("Markers", link, "/markers", namespace="/r1").layer
    publish(link, cube(1, "odom", locked=True))
    received = transform("map", "odom", 4.0, 0.0, 0.0, 100.0)
    link.publish("/r1/tf", {"transforms": [received]})
    publish(link, cube(1, "odom", locked=True))
    assert middle(layer, 1) == pytest.approx((5.0, 0.0))


def test_markers_are_placed_by_the_alignment_of_their_bridge(link, layer):
    publish(link, cube(1, "map"))
    align_bridge(link, 2.0, 3.0, 90.0)
    assert middle(layer, 1) == pytest.approx((2.0, 4.0))


def test_an_invalid_frame_locked_marker_is_not_drawn_when_its_frame_moves(link, layer):
    wrong = cube(1, "base_link", locked=True, at=(math.nan, 0.0, 0.0))
    publish(link, {**wrong, "pose": {**pose(0, 0), "position": {"x": None, "y": 0}}})
    drive(link, 5.0, 100.0)
    drive(link, 6.0, 101.0)
    assert layer.shapes == {}
    assert to_root(layer.svg) == Affine()


def test_a_marker_that_cannot_follow_its_frame_is_left_out_with_a_problem(
    link, layer, robot, monkeypatch
):
    def place(shape, marker, frame):
        if marker.id == 1 and frame.translation.y > 7.5:
            raise ProtocolError("it is beyond the end of the world")
        shape_place(shape, marker, frame)

    shape_place = markers.place
    monkeypatch.setattr(markers, "place", place)
    publish(link, cube(1, "base_link", locked=True), cube(2, "base_link", locked=True))
    robot.set_tf(link)
    drive(link, 7.0, 101.0)
    assert layer.problems == {}
    drive(link, 8.0, 102.0)
    assert list(layer.shapes) == [("test", 2)]
    assert middle(layer, 2) == pytest.approx((10.0, 9.0))
    assert (robot.position.x, robot.position.y) == pytest.approx((10.0, 8.0))
    expected = ["/markers: marker 1 of 'test': it is beyond the end of the world"]
    assert list(layer.problems.values()) == expected
    drive(link, 9.0, 103.0)
    assert middle(layer, 2) == pytest.approx((10.0, 10.0))
    assert list(layer.problems.values()) == expected, "until the next message"
    publish(link, cube(2, "base_link", locked=True))
    assert layer.problems == {}
