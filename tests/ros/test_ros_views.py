import json
import math
from array import array

import pytest

from equipment.captured_frames import CAPTURED
from webmap.base.errors import ConfigError, ProtocolError
from webmap.poses.placing import (
    ODOMETRY_VIEWS,
    odometry_view,
    odometry_view_by_shape,
)
from webmap.ros import messages
from webmap.ros.arrays import Floats, Int8s
from webmap.ros.decoding import convert
from webmap.ros.rosbridge.cbor import typed_array

PLACE = {
    "position": {"x": 1.0, "y": 2.0, "z": 0.0},
    "orientation": {"x": 0.0, "y": 0.0, "z": 1.0, "w": 0.0},
}
SHAPES = {
    "nav_msgs/Odometry": {
        "header": {"frame_id": "odom"},
        "pose": {"pose": PLACE},
        "twist": {"twist": {"linear": {"x": 1, "y": 0}, "angular": {"x": 0, "y": 0}}},
    },
    "geometry_msgs/PoseWithCovarianceStamped": {"header": {}, "pose": {"pose": PLACE}},
    "geometry_msgs/PoseStamped": {"header": {}, "pose": PLACE},
    "geometry_msgs/Pose": PLACE,
    "geometry_msgs/Pose2D": {"x": 1.0, "y": 2.0, "theta": math.pi},
}


@pytest.mark.parametrize("type", sorted(SHAPES))
def test_the_odometry_view_is_chosen_by_the_shape_of_the_message(type):
    view = odometry_view_by_shape(SHAPES[type])
    assert view is ODOMETRY_VIEWS[type]
    assert view is odometry_view(type.replace("/", "/msg/"))
    message = convert(SHAPES[type], view)
    assert message.place.planar.x == 1
    assert message.place.planar.y == 2
    assert abs(message.place.planar.yaw) == pytest.approx(math.pi)
    assert message.frame_id in ("", "odom")
    assert message.stamp == 0


@pytest.mark.parametrize("path", sorted(CAPTURED.glob("*/publish_[bst]*.json")))
def test_a_captured_message_without_a_pose_is_refused_as_odometry(path):
    message = json.loads(path.read_text()).get("msg")
    if isinstance(message, dict):
        with pytest.raises(ProtocolError, match="nav_msgs/Odometry"):
            odometry_view_by_shape(message)


def test_types_without_a_pose_are_refused_as_odometry():
    with pytest.raises(ConfigError, match="nav_msgs/Odometry"):
        odometry_view("sensor_msgs/LaserScan")


def test_stamps_of_both_dialects_convert_to_seconds():
    assert messages.Time(secs=5, nsecs=500_000_000).seconds == 5.5
    assert messages.Time(sec=5, nanosec=500_000_000).seconds == 5.5


@pytest.mark.parametrize(
    ("value", "numbers"),
    [
        ([1, 2.5], [1, 2.5]),
        ([], []),
        (None, []),
        (array("d", [1.5]), [1.5]),
        (array("f", [1.5]).tobytes(), [1.5]),
    ],
)
def test_every_wire_form_of_an_array_converts_to_numbers(value, numbers):
    assert Floats.from_wire(value).array().tolist() == numbers


def test_null_in_a_number_array_becomes_nan():
    values = Floats.from_wire([None, 2.0]).array()
    assert math.isnan(values[0])
    assert values[1] == 2


@pytest.mark.parametrize("bad", [["1"], "12", {}, 5, [[1]], b"abc", [10**400]])
def test_a_value_other_than_a_number_array_is_refused(bad):
    with pytest.raises(ValueError, match="expected an array of numbers"):
        Floats.from_wire(bad)


@pytest.mark.parametrize("bad", [[200], [-129], [None], [0.5]])
def test_cells_that_are_not_int8_values_are_refused(bad):
    with pytest.raises(ValueError, match="expected an array of numbers"):
        Int8s.from_wire(bad)


@pytest.mark.parametrize(("tag", "code"), [(85, "<f"), (81, ">f"), (86, "<d")])
def test_typed_arrays_of_both_byte_orders_are_read(tag, code):
    import struct

    assert typed_array(tag, struct.pack(code, 1.5)).tolist() == [1.5]


def test_a_truncated_or_non_binary_typed_array_is_refused():
    with pytest.raises(ValueError, match="multiple"):
        typed_array(85, b"abc")
    with pytest.raises(ValueError, match="not bytes"):
        typed_array(85, [1])


@pytest.mark.parametrize(
    ("width", "height"), [(2, 2), (-1, -3), (2**31, 2**31), (0, 1)]
)
def test_a_grid_whose_size_does_not_match_its_data_is_refused(width, height):
    info = {"resolution": 0.05, "width": width, "height": height, "origin": PLACE}
    grid = convert({"info": info, "data": [0, 100, -1]}, messages.OccupancyGridMsg)
    with pytest.raises(ProtocolError, match="grid"):
        _ = grid.cells


def test_a_pose_with_missing_coordinates_is_an_error():
    with pytest.raises(ProtocolError):
        convert({"position": {}, "orientation": {}}, messages.PoseMsg)
