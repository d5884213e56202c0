from array import array

import numpy as np
import pytest

from webmap.ros.message_check import Misfit
from webmap.ros.serialized.reader import make_reader
from webmap.ros.serialized.schemas import read_schema
from webmap.ros.serialized.writer import make_writer

LINE = "=" * 80
SEND_GOAL = f"""unique_identifier_msgs/UUID goal_id
nav2_msgs/NavigateToPose_Goal goal
{LINE}
MSG: unique_identifier_msgs/UUID
uint8[16] uuid
{LINE}
MSG: nav2_msgs/action/NavigateToPose_Goal
geometry_msgs/PoseStamped pose
string behavior_tree
{LINE}
MSG: geometry_msgs/PoseStamped
std_msgs/Header header
geometry_msgs/Pose pose
{LINE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{LINE}
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
{LINE}
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
{LINE}
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
"""


def tools(name, encoding="cdr", text=None):
    schema = read_schema(name, "ros2msg" if encoding == "cdr" else "ros1msg", text)
    return make_writer(schema, encoding), make_reader(schema, None, encoding)


def test_a_velocity_has_the_bytes_of_ros():
    write, _ = tools("geometry_msgs/msg/Twist")
    data = write({"linear": {"x": 0.5}, "angular": {"z": -1.0}})
    assert data == b"\0\1\0\0" + np.array([0.5, 0, 0, 0, 0, -1.0], "<f8").tobytes()
    write, _ = tools("geometry_msgs/Twist", "ros1")
    assert write({"linear": {"x": 0.5}, "angular": {"z": -1.0}}) == data[4:]


def test_an_empty_request_has_one_byte_in_cdr_and_none_in_ros1():
    assert tools("std_srvs/TriggerRequest")[0]({}) == b"\0\1\0\0\0"
    assert tools("std_srvs/TriggerRequest", "ros1")[0]({}) == b""
    assert tools("std_msgs/Bool")[0]({"data": True}) == b"\0\1\0\0\1"


def test_a_goal_of_an_action_is_written():
    write, read = tools(
        "nav2_msgs/action/NavigateToPose_SendGoal_Request", text=SEND_GOAL
    )
    pose = {"header": {"frame_id": "map"}, "pose": {"position": {"x": 1.5, "y": 2.0}}}
    for uuid in (bytes(range(16)), list(range(16))):
        data = write({"goal_id": {"uuid": uuid}, "goal": {"pose": pose}})
        assert data[4:20] == bytes(range(16))
        message = read(data)
        assert message["goal_id"]["uuid"] == bytes(range(16))
        assert message["goal"]["pose"]["header"]["frame_id"] == "map"
        assert message["goal"]["pose"]["pose"]["position"]["x"] == 1.5
        assert message["goal"]["pose"]["pose"]["orientation"]["w"] == 1.0
    write, read = tools("action_msgs/CancelGoalRequest")
    stamp = {"sec": 5, "nanosec": 6}
    data = write({"goal_info": {"goal_id": {"uuid": bytes(16)}, "stamp": stamp}})
    assert read(data)["goal_info"]["stamp"] == stamp


def test_a_goal_of_move_base_is_written():
    write, read = tools("move_base_msgs/MoveBaseActionGoal", "ros1")
    stamp = {"secs": 1_795_252_456, "nsecs": 126_026_868}
    message = read(
        write(
            {
                "goal_id": {"stamp": stamp, "id": "goal 1"},
                "goal": {"target_pose": {"header": {"frame_id": "map"}}},
            }
        )
    )
    assert message["goal_id"] == {"stamp": stamp, "id": "goal 1"}
    assert message["goal"]["target_pose"]["header"]["frame_id"] == "map"


def test_a_time_may_have_the_names_of_either_dialect():
    write, read = tools("std_msgs/Header")
    for stamp in ({"secs": 5, "nsecs": 6}, {"sec": 5, "nanosec": 6}):
        assert read(write({"stamp": stamp}))["stamp"] == {"sec": 5, "nanosec": 6}
    write, read = tools("std_msgs/Header", "ros1")
    assert read(write({"stamp": {"sec": 5}}))["stamp"] == {"secs": 5, "nsecs": 0}


@pytest.mark.parametrize("encoding", ["cdr", "ros1"])
@pytest.mark.parametrize(
    "values",
    [
        [1, 2],
        (1, 2),
        array("h", [1, 2]),
        array("d", [1, 2]),
        np.array([1, 2], np.int16),
        np.array([1, 2], ">i8"),
    ],
)
def test_an_array_of_numbers_may_be_of_any_kind(encoding, values):
    write, read = tools("a/B", encoding, "int16[] a\nfloat64[] b")
    if getattr(values, "typecode", "") == "d":
        values = [int(each) for each in values]
    message = read(write({"a": values, "b": values}))
    assert message == {"a": array("h", [1, 2]), "b": array("d", [1, 2])}


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ({"a": 300}, r"a: got 300, expected a value of uint8"),
        ({"a": "x"}, r"a: got .x., expected a value of uint8"),
        ({"b": [{}, {"s": 5}]}, r"b\[1\]\.s: got 5, expected a text"),
        ({"b": [1]}, r"b\[0\]: got 1, expected a table of fields"),
        ({"b": 5}, r"b: got 5, expected values of a/C"),
        ({"c": [1.0]}, r"c: got 1 values, expected 2 values of float32"),
        ({"c": ["x", 2]}, r"c: .*expected values of float32"),
        ({"c": [1e300, 2]}, r"c: .*expected values of float32"),
        ({"d": [1] * 4}, r"d: got 4 values, expected at most 3 values of int64"),
        ({"t": 5.0}, r"t: got 5.0, expected a time"),
        ({"t": {"sec": -(2**40)}}, r"t\.sec: .*expected a value of int32"),
        ({"nope": 1}, "nope: no such field; there are a, b, c, d, t"),
        ({"b": [{"s": "\ud800"}]}, "s: .*that UTF-8 can hold"),
        ([], "expected a table of fields"),
    ],
)
def test_a_value_that_does_not_fit_is_refused_with_its_place(message, words):
    text = "uint8 a\nC[] b\nfloat32[2] c\nint64[<=3] d\nbuiltin_interfaces/Time t\n"
    write, _ = tools("a/B", text=f"{text}====\nMSG: a/C\nstring s")
    with pytest.raises(Misfit, match=words):
        write(message)
