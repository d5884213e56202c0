"""Messages over rosbridge and what rosbags has in their place, there and back."""

import base64
import math
from array import array

import numpy as np
import pytest
from rosbags.typesys import get_types_from_msg

from bag_making import types_of
from webmap.bags.reading import Messages
from webmap.bags.shapes import shapes_of
from webmap.bags.stamps import Stamps
from webmap.bags.writing import Misfit
from webmap.sim.rosbridge.dialect import Dialect, canonical
from webmap.sim.rosbridge.schema import Schema, UnknownType

SCAN = "sensor_msgs/LaserScan"
GOALS = "actionlib_msgs/GoalStatusArray"


def way_of(made, type_name):
    return next(types_of(made.dialect).ways(type_name))


def again(made, type_name, message):
    """A message that went through rosbags' bytes."""
    way = way_of(made, type_name)
    read = (
        way.store.deserialize_ros1
        if made.dialect == "ros1"
        else way.store.deserialize_cdr
    )
    made.schema.define(type_name, shapes_of(way.store, way.type_name))
    value = read(way.bytes_of(message), way.type_name)
    return Messages(made.schema).message(type_name, value)


def plain(value):
    """A message in which equal arrays and bytes compare equal."""
    if isinstance(value, dict):
        return {name: plain(item) for name, item in value.items()}
    if isinstance(value, np.ndarray | bytes | array):
        return list(value)
    return [plain(item) for item in value] if isinstance(value, list) else value


@pytest.mark.parametrize(
    ("type_name", "fields"),
    [
        (SCAN, {"ranges": [1.5, 2.5, 0.25], "angle_min": -0.5}),
        ("nav_msgs/Odometry", {"child_frame_id": "base_link"}),
        ("nav_msgs/OccupancyGrid", {"data": [0, -1, 100]}),
        ("sensor_msgs/CompressedImage", {"format": "jpeg", "data": [255, 216]}),
        ("tf2_msgs/TFMessage", {"transforms": [{"child_frame_id": "odom"}, {}]}),
        ("visualization_msgs/Marker", {"points": [{"x": 1.0}], "text": "Tür"}),
        ("std_msgs/Empty", {}),
    ],
)
def test_a_message_is_the_same_after_it_was_written_and_read(made, type_name, fields):
    if made.dialect == "ros2" and type_name == "visualization_msgs/Marker":
        pytest.skip("the simulator's marker has the fields of ROS 1")
    message = made.message(type_name, **fields)
    assert plain(again(made, type_name, message)) == plain(message)


def test_arrays_are_taken_as_cbor_has_them_and_as_json_has_them(made):
    by_list = made.message(SCAN) | {"ranges": [1.0, 2.0]}
    by_array = by_list | {"ranges": array("f", [1.0, 2.0])}
    way = way_of(made, SCAN)
    assert way.bytes_of(by_list) == way.bytes_of(by_array)


def test_bytes_are_taken_as_base64_and_as_they_are(made):
    image = made.message("sensor_msgs/CompressedImage", data=[1, 2, 3])
    way = way_of(made, "sensor_msgs/CompressedImage")
    text = image | {"data": base64.b64encode(bytes([1, 2, 3])).decode()}
    assert way.bytes_of(text) == way.bytes_of(image | {"data": bytes([1, 2, 3])})


def test_what_json_has_for_a_number_that_is_none_becomes_nan(made):
    scan = made.message(SCAN) | {"ranges": [None, 2.0], "range_max": None}
    read = again(made, SCAN, scan)
    assert math.isnan(read["ranges"][0])
    assert read["ranges"][1] == 2.0
    assert math.isnan(read["range_max"])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"ranges": "far"}, "ranges: no base64"),
        ({"ranges": [{}]}, "ranges: "),
        ({"range_min": "near"}, "range_min: "),
        ({"colour": "red"}, "differs in colour"),
        ({"header": 3}, "std_msgs/Header is a table of fields, got 3"),
    ],
)
def test_a_message_that_does_not_fit_its_type_says_where(made, change, words):
    scan = made.message(SCAN) | change
    with pytest.raises(Misfit) as refused:
        way_of(made, SCAN).bytes_of(scan)
    assert words in str(refused.value)


@pytest.mark.parametrize("data", [[1.7, 2], [300, 2], array("d", [1.7]), [None]])
def test_whole_numbers_are_not_made_of_what_is_none(made, data):
    grid = made.message("nav_msgs/OccupancyGrid") | {"data": data}
    with pytest.raises(Misfit, match="data: "):
        way_of(made, "nav_msgs/OccupancyGrid").bytes_of(grid)


@pytest.mark.parametrize("data", [[1.0, -1], array("h", [1, -1]), b"\x01\xff"])
def test_whole_numbers_are_taken_in_whatever_form_they_come(made, data):
    way = way_of(made, "nav_msgs/OccupancyGrid")
    grid = made.message("nav_msgs/OccupancyGrid")
    assert way.bytes_of(grid | {"data": data}) == way.bytes_of(grid | {"data": [1, -1]})


def test_a_number_that_is_too_large_for_a_float_does_not_fit(made):
    scan = made.message(SCAN) | {"range_min": 1e300}
    with pytest.raises(Misfit):
        way_of(made, SCAN).bytes_of(scan)


def test_a_fixed_array_of_another_length_does_not_fit(made):
    odometry = made.message("nav_msgs/Odometry")
    odometry["pose"] = odometry["pose"] | {"covariance": [0.0] * 35}
    with pytest.raises(Misfit, match="expected 36 values, got 35"):
        way_of(made, "nav_msgs/Odometry").bytes_of(odometry)


@pytest.mark.parametrize(
    ("dialect", "type_name", "message"),
    [
        (
            "ros2",
            "nav2_msgs/msg/ParticleCloud",
            {
                "header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "map"},
                "particles": [
                    {
                        "pose": {
                            "position": {"x": 1.0, "y": 2.0, "z": 0.0},
                            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
                        },
                        "weight": 0.5,
                    }
                ],
            },
        ),
        (
            "ros2",
            "nav2_msgs/action/NavigateToPose_FeedbackMessage",
            {
                "goal_id": {"uuid": list(range(16))},
                "feedback": {
                    "current_pose": {
                        "header": {
                            "stamp": {"sec": 1, "nanosec": 2},
                            "frame_id": "map",
                        },
                        "pose": {
                            "position": {"x": 1.0, "y": 2.0, "z": 0.0},
                            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
                        },
                    },
                    "navigation_time": {"sec": 3, "nanosec": 0},
                    "estimated_time_remaining": {"sec": 4, "nanosec": 0},
                    "number_of_recoveries": 1,
                    "distance_remaining": 2.5,
                },
            },
        ),
    ],
)
def test_how_goals_go_and_particles_are_written(dialect, type_name, message):
    way = next(types_of(dialect).ways(type_name))
    data = way.bytes_of(message)
    assert len(data) > 40
    read = way.store.deserialize_cdr(data, way.type_name)
    if "Particle" in type_name:
        assert read.particles[0].weight == 0.5
    else:
        assert read.feedback.distance_remaining == 2.5


def test_a_type_that_no_release_has_has_no_way_to_be_written(made):
    types = types_of(made.dialect)
    for name in ("acme_msgs/Arm", "nonsense", "nav2_msgs/action/Wait_Feedback"):
        assert list(types.ways(name)) == []


def test_every_stamp_is_moved_however_deep_and_no_other_time(made):
    schema = made.schema
    path = made.message(
        "nav_msgs/Path", poses=[{"header": {"stamp": made.time(3.0)}}, {}]
    )
    grid = made.message("nav_msgs/OccupancyGrid", info={"map_load_time": made.time(1)})
    stamps = Stamps(schema)
    stamps.move("nav_msgs/Path", path, lambda stamp: stamp + 2 * 10**9 + 5)
    stamps.move("nav_msgs/OccupancyGrid", grid, lambda stamp: stamp + 10**9)
    whole, rest = made.time(0)
    begin = made.time(0)[whole]
    assert path["poses"][0]["header"]["stamp"] == {whole: begin + 5, rest: 5}
    assert path["poses"][1]["header"]["stamp"] == {whole: 2, rest: 5}
    assert path["header"]["stamp"] == {whole: 2, rest: 5}
    assert grid["info"]["map_load_time"] == made.time(1)


def test_stamps_in_lists_of_parts_are_moved_too():
    schema = Schema(Dialect("ros1"))
    message = schema.conform(GOALS, {"status_list": [{"goal_id": {"id": "a"}}]})
    Stamps(schema).move(GOALS, message, lambda stamp: stamp + 7)
    assert message["status_list"][0]["goal_id"]["stamp"] == {"secs": 0, "nsecs": 7}


def test_a_type_whose_parts_nobody_knows_is_unknown_as_a_whole(made):
    store = way_of(made, SCAN).store
    store.register(get_types_from_msg("acme_msgs/Joint[] joints", "acme_msgs/msg/Arm"))
    with pytest.raises(UnknownType, match="acme_msgs/msg/Joint"):
        shapes_of(store, "acme_msgs/msg/Arm")


def test_a_field_that_is_a_word_of_python_keeps_its_name(made):
    store = way_of(made, SCAN).store
    name = "acme_msgs/msg/Way"
    store.register(get_types_from_msg("string from\nfloat32 class", name))
    shapes = shapes_of(store, name)
    fields = [field.name for field in shapes[canonical(name)]]
    assert fields == ["from", "class"]
