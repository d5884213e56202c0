"""Messages of a rosbridge that are written to bags, and read from them."""

import base64
import contextlib
import math
from array import array

import numpy as np
import pytest
from rosbags.typesys import get_types_from_msg

from equipment.bag_files import BEGIN, Made, types_of
from webmap.bags.recording import Recording
from webmap.bags.times import Stamps
from webmap.bags.types import texts_of
from webmap.ros.definitions import Definitions, UnknownType
from webmap.ros.message_check import Misfit
from webmap.ros.rosbridge.server.dialect import Dialect
from webmap.ros.rosbridge.server.schema import Schema

SCAN = "sensor_msgs/LaserScan"
GOALS = "actionlib_msgs/GoalStatusArray"


def version_of(made, type_name):
    return next(types_of(made.dialect).versions(type_name))


def again(made, folder, type_name, message):
    """Return a message after it was written to a bag and read from there."""
    bag = made.bag(folder / "again", ("/again", type_name, 0.0, message))
    with contextlib.closing(Recording([bag])) as recording:
        (recorded,) = recording.messages(BEGIN)
        return recording.message(recorded)


def plain(value):
    """Return a message in which equal arrays and bytes compare equal."""
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
def test_a_message_is_unchanged_after_writing_and_reading(
    made, tmp_path, type_name, fields
):
    message = made.message(type_name, **fields)
    assert plain(again(made, tmp_path, type_name, message)) == plain(message)


def test_arrays_from_cbor_and_lists_from_json_give_the_same_bytes(made):
    by_list = made.message(SCAN) | {"ranges": [1.0, 2.0]}
    by_array = by_list | {"ranges": array("f", [1.0, 2.0])}
    version = version_of(made, SCAN)
    assert version.bytes_of(by_list) == version.bytes_of(by_array)


def test_base64_text_and_plain_bytes_give_the_same_bytes(made):
    image = made.message("sensor_msgs/CompressedImage", data=[1, 2, 3])
    version = version_of(made, "sensor_msgs/CompressedImage")
    text = image | {"data": base64.b64encode(bytes([1, 2, 3])).decode()}
    assert version.bytes_of(text) == version.bytes_of(
        image | {"data": bytes([1, 2, 3])}
    )


def test_null_in_json_becomes_nan(made, tmp_path):
    scan = made.message(SCAN) | {"ranges": [None, 2.0], "range_max": None}
    read = again(made, tmp_path, SCAN, scan)
    assert math.isnan(read["ranges"][0])
    assert read["ranges"][1] == 2.0
    assert math.isnan(read["range_max"])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"ranges": "far"}, "ranges: no base64"),
        ({"ranges": [{}]}, "ranges: "),
        ({"range_min": "near"}, "range_min: "),
        ({"colour": "red"}, "colour: no such field; there are header, angle_min"),
        ({"header": 3}, "header: got 3, expected a table of fields"),
        ({"header": {}}, ": it is missing"),
        ({"header": {"stemp": {}}}, "header.stemp: no such field; there are "),
    ],
)
def test_the_error_for_a_message_that_does_not_fit_its_type_names_the_field(
    made, change, words
):
    scan = made.message(SCAN) | change
    with pytest.raises(Misfit) as refused:
        version_of(made, SCAN).bytes_of(scan)
    assert words in str(refused.value)


@pytest.mark.parametrize("data", [[1.7, 2], [300, 2], array("d", [1.7]), [None]])
def test_values_that_are_not_valid_integers_are_refused(made, data):
    grid = made.message("nav_msgs/OccupancyGrid") | {"data": data}
    with pytest.raises(Misfit, match="data: "):
        version_of(made, "nav_msgs/OccupancyGrid").bytes_of(grid)


@pytest.mark.parametrize("data", [[1.0, -1], array("h", [1, -1]), b"\x01\xff"])
def test_integers_are_accepted_as_floats_arrays_and_bytes(made, data):
    version = version_of(made, "nav_msgs/OccupancyGrid")
    grid = made.message("nav_msgs/OccupancyGrid")
    assert version.bytes_of(grid | {"data": data}) == version.bytes_of(
        grid | {"data": [1, -1]}
    )


def test_a_number_too_large_for_a_float_field_is_refused(made):
    scan = made.message(SCAN) | {"range_min": 1e300}
    with pytest.raises(Misfit):
        version_of(made, SCAN).bytes_of(scan)


def test_a_fixed_array_with_a_wrong_length_is_refused(made):
    odometry = made.message("nav_msgs/Odometry")
    odometry["pose"] = odometry["pose"] | {"covariance": [0.0] * 35}
    with pytest.raises(Misfit, match=r"pose.covariance: got 35 values, expected 36"):
        version_of(made, "nav_msgs/Odometry").bytes_of(odometry)


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
def test_goal_feedback_and_particle_clouds_are_written(dialect, type_name, message):
    version = next(types_of(dialect).versions(type_name))
    data = version.bytes_of(message)
    assert len(data) > 40
    read = version.store.deserialize_cdr(data, version.type_name)
    if "Particle" in type_name:
        assert read.particles[0].weight == 0.5
    else:
        assert read.feedback.distance_remaining == 2.5


def test_goal_feedback_is_unchanged_after_recording(tmp_path):
    type_name = "nav2_msgs/action/NavigateToPose_FeedbackMessage"
    made = Made("ros2")
    message = made.message(type_name, feedback={"distance_remaining": 2.5})
    path = made.bag(tmp_path / "goal", ("/feedback", type_name, 0.0, message))
    recording = Recording([path])
    (recorded,) = recording.messages(BEGIN)
    assert recording.message(recorded) == message
    recording.close()


def test_an_unknown_type_has_no_version(made):
    types = types_of(made.dialect)
    for name in ("acme_msgs/Arm", "nonsense", "nav2_msgs/action/Wait_Feedback"):
        assert list(types.versions(name)) == []


def test_all_nested_header_stamps_are_moved_and_other_times_are_not(made):
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


def test_stamps_in_lists_of_nested_messages_are_moved():
    schema = Schema(Dialect("ros1"))
    message = schema.conform(GOALS, {"status_list": [{"goal_id": {"id": "a"}}]})
    Stamps(schema).move(GOALS, message, lambda stamp: stamp + 7)
    assert message["status_list"][0]["goal_id"]["stamp"] == {"secs": 0, "nsecs": 7}


def test_a_type_with_an_unknown_field_type_is_unknown(made):
    store = version_of(made, SCAN).store
    store.register(get_types_from_msg("acme_msgs/Joint[] joints", "acme_msgs/msg/Arm"))
    with pytest.raises(UnknownType, match="acme_msgs/msg/Joint"):
        texts_of(store, "acme_msgs/msg/Arm")


def test_a_field_named_like_a_python_keyword_keeps_its_name(made):
    store = version_of(made, SCAN).store
    name = "acme_msgs/msg/Way"
    store.register(get_types_from_msg("string from\nfloat32 class", name))
    fields = Definitions(texts_of(store, name), ros2=True).definition(name).fields
    assert [field.name for field in fields] == ["from", "class"]
