"""The bytes of the messages of Foxglove, compared with those of rosbags."""

import math
import struct

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from equipment.declarations import declared
from webmap.base.errors import ProtocolError
from webmap.base.geometry import Twist
from webmap.gate.actions import SendGoal, SendPose
from webmap.gate.events import Key
from webmap.gate.lanes import rosbridge, serialization
from webmap.gate.lanes.serialization import MOST_TEXT, serialized, velocity

STORES = {
    "cdr": get_typestore(Stores.ROS2_HUMBLE),
    "ros1": get_typestore(Stores.ROS1_NOETIC),
}
ENCODINGS = list(STORES)
TWIST = Twist(0.5, 0.25, -1.0, 0.125, 2.0, 3.0)
GOAL = SendGoal(Key("u", "t"), "r1", "g1", 1.0, 2.0, math.pi / 2, "a", "topic")

ACTION = "move_base_msgs/msg/MoveBaseAction"
for definition, part in {
    "geometry_msgs/PoseStamped target_pose": "Goal",
    "": "Result",
    "geometry_msgs/PoseStamped base_position": "Feedback",
}.items():
    name = ACTION.replace("Action", part)
    STORES["ros1"].register(get_types_from_msg(definition, name))
for text, part in {
    "actionlib_msgs/GoalID goal_id\nMoveBaseGoal goal": "Goal",
    "actionlib_msgs/GoalStatus status\nMoveBaseResult result": "Result",
    "actionlib_msgs/GoalStatus status\nMoveBaseFeedback feedback": "Feedback",
}.items():
    full = f"std_msgs/Header header\n{text}"
    STORES["ros1"].register(get_types_from_msg(full, f"{ACTION}{part}"))


def make(encoding, type, **fields):
    """Return a message of rosbags; a field left out is zero or empty."""
    store = STORES[encoding]
    package, name = type.split("/")
    return _made(store, f"{package}/msg/{name}", fields)


def _made(store, type, given):
    values = {}
    for name, (kind, detail) in store.get_msgdef(type).fields:
        if kind == 2:  # a type in it
            values[name] = _made(store, detail, given.get(name, {}))
        elif name in given:
            values[name] = given[name]
        elif kind == 3:
            values[name] = np.zeros(detail[1], dtype=np.float64)
        elif kind == 4:
            number = detail[0][0] == 1
            values[name] = np.zeros(0, dtype=np.float32) if number else []
        elif detail[0] == "string":
            values[name] = ""
        else:
            values[name] = 0
    return store.types[type](**values)


def written(encoding, message):
    store = STORES[encoding]
    name = message.__msgtype__
    if encoding == "cdr":
        return bytes(store.serialize_cdr(message, name))
    return bytes(store.serialize_ros1(message, name))


def read(encoding, type, data):
    package, name = type.split("/")
    store = STORES[encoding]
    how = store.deserialize_cdr if encoding == "cdr" else store.deserialize_ros1
    return how(data, f"{package}/msg/{name}")


LINEAR = {"x": 0.5, "y": 0.25, "z": 0.125}
ANGULAR = {"x": 2.0, "y": 3.0, "z": -1.0}
FIELDS = {"linear": LINEAR, "angular": ANGULAR}
HEADER = {"frame_id": "base_link"}

WITH_TWIST = {
    "geometry_msgs/Twist": FIELDS,
    "geometry_msgs/TwistStamped": {"header": HEADER, "twist": FIELDS},
    "geometry_msgs/TwistWithCovarianceStamped": {
        "header": HEADER,
        "twist": {"twist": FIELDS},
    },
    "nav_msgs/Odometry": {
        "header": {"frame_id": "odom"},
        "child_frame_id": "base_footprint",
        "twist": {"twist": FIELDS},
    },
}


@pytest.mark.parametrize("encoding", ENCODINGS)
class TestVelocity:
    @pytest.mark.parametrize("type", WITH_TWIST)
    def test_the_velocity_of_each_type_is_read(self, encoding, type):
        data = b"head" + written(encoding, make(encoding, type, **WITH_TWIST[type]))
        assert serialization.velocity_in(data, 4, type, encoding) == TWIST
        with pytest.raises(ProtocolError, match="too short"):
            serialization.velocity_in(data[:50], 4, type, encoding)

    def test_another_type_has_no_velocity(self, encoding):
        assert serialization.velocity_in(b"", 0, "std_msgs/Bool", encoding) is None

    def test_a_velocity_that_is_not_finite_is_none(self, encoding):
        message = make(encoding, "geometry_msgs/Twist", linear={"x": math.nan})
        data = written(encoding, message)
        found = serialization.velocity_in(data, 0, "geometry_msgs/Twist", encoding)
        assert found is None

    @pytest.mark.parametrize("frame", ["", "b", "base", "base_link"])
    @pytest.mark.parametrize("type", ["Twist", "TwistStamped"])
    def test_a_velocity_is_written(self, encoding, type, frame):
        name = f"geometry_msgs/{type}"
        data = velocity(name, TWIST, frame, encoding)
        assert serialization.velocity_in(data, 0, name, encoding) == TWIST
        message = read(encoding, name, data)
        if type == "TwistStamped":
            assert message.header.frame_id == frame
            message = message.twist
        assert message.linear.x == 0.5
        assert message.angular.z == -1.0

    def test_whole_numbers_are_written_as_floats_too(self, encoding):
        data = velocity("geometry_msgs/Twist", Twist(1), "", encoding)
        assert read(encoding, "geometry_msgs/Twist", data).linear.x == 1.0


def test_both_byte_orders_are_read_and_other_forms_are_refused():
    data = b"\0\0\0\0" + struct.pack(">6d", 0.5, 0.25, 0.125, 2.0, 3.0, -1.0)
    assert serialization.velocity_in(data, 0, "geometry_msgs/Twist", "cdr") == TWIST
    with pytest.raises(ProtocolError, match="another form"):
        serialization.velocity_in(b"\0\7", 0, "geometry_msgs/Twist", "cdr")


def test_a_text_of_unlikely_length_is_refused():
    data = struct.pack("<4IB", 0, 0, 0, MOST_TEXT + 1, 0)
    with pytest.raises(ProtocolError, match="a text of"):
        serialization.velocity_in(data, 0, "geometry_msgs/TwistStamped", "ros1")


@pytest.mark.parametrize("encoding", ENCODINGS)
class TestScan:
    def scan(self, encoding, count):
        ranges = np.full(count, 2.0, dtype=np.float32)
        message = make(
            encoding,
            "sensor_msgs/LaserScan",
            header={"frame_id": "/laser"},
            angle_min=-1.5,
            angle_increment=0.0001,
            range_min=0.25,
            range_max=8.0,
            ranges=ranges,
        )
        return serialization.scan_in(written(encoding, message), 0, encoding, 7.0)

    def test_a_scan_is_read(self, encoding):
        scan = self.scan(encoding, 5)
        assert (scan.angle_min, scan.range_min, scan.range_max) == (-1.5, 0.25, 8.0)
        assert scan.angle_increment == pytest.approx(0.0001)
        assert list(scan.ranges) == [2.0] * 5
        assert (scan.frame, scan.arrived, scan.refused) == ("laser", 7.0, None)

    def test_a_scan_of_far_too_many_beams_is_refused(self, encoding):
        scan = self.scan(encoding, 100_001)
        assert "100001 beams" in scan.refused
        assert list(scan.ranges) == []


SPEC = declared(
    id="r1",
    name="Bob",
    bridge_url="ws://r",
    goal_topic="/goal",
    goal_frame="world",
    action="/move_base",
    action_type="move_base_msgs/MoveBaseAction",
    pose_topic="/initialpose",
    pose_covariance=(0.1, 0.2, 0.3),
)


@pytest.mark.parametrize("encoding", ENCODINGS)
class TestMessages:
    def test_a_goal_on_a_topic(self, encoding):
        _, type, fields = rosbridge.goal_message(SPEC, GOAL)
        found = read(encoding, type, serialized(fields, encoding))
        assert found.header.frame_id == "world"
        assert (found.pose.position.x, found.pose.position.y) == (1.0, 2.0)
        assert found.pose.orientation.z == pytest.approx(math.sqrt(0.5))

    def test_an_initial_pose(self, encoding):
        at = SendPose(Key("u", "t"), "r1", 1.0, 2.0, 0.0, "a")
        _, type, fields = rosbridge.pose_estimate(SPEC, at)
        found = read(encoding, type, serialized(fields, encoding))
        assert found.pose.pose.position.y == 2.0
        assert list(found.pose.covariance[[0, 7, 35]]) == [0.1, 0.2, 0.3]

    def test_a_flag(self, encoding):
        for value in (True, False):
            data = serialized({"data": value}, encoding)
            assert read(encoding, "std_msgs/Bool", data).data == value

    def test_bytes_and_whole_numbers(self, encoding):
        data = serialized({"id": b"\1\2\3", "n": 7}, encoding)
        head = b"\0\1\0\0" if encoding == "cdr" else b""
        gap = b"\0" if encoding == "cdr" else b""
        assert data == head + b"\1\2\3" + gap + struct.pack("<i", 7)

    def test_the_answer_of_a_trigger(self, encoding):
        store = STORES["ros1"]
        store.register(
            get_types_from_msg("bool success\nstring message", "a/msg/Answer")
        )
        if encoding == "cdr":
            data = b"\0\1\0\0" + b"\1\0\0\0" + struct.pack("<I", 5) + b"done\0"
        else:
            answer = store.types["a/msg/Answer"](True, "done")
            data = bytes(store.serialize_ros1(answer, "a/msg/Answer"))
        assert serialization.trigger_result(data, encoding) == (True, "done")


def actionlib(part, **fields):
    name = f"move_base_msgs/MoveBaseAction{part}"
    return name, written("ros1", make("ros1", name, **fields))


class TestMoveBase:
    def test_a_goal_and_its_cancel(self):
        goal = SendGoal(*(*GOAL_FIELDS, "move_base"))
        _, type, fields = rosbridge.goal_message(SPEC, goal)
        found = read("ros1", type, serialized(fields, "ros1"))
        assert found.goal_id.id == "g1"
        assert found.goal.target_pose.pose.position.x == 1.0
        assert found.goal.target_pose.header.frame_id == "world"
        data = serialized(rosbridge.EVERY_GOAL, "ros1")
        assert read("ros1", rosbridge.GOAL_ID, data).id == ""

    def test_the_status_of_goals(self):
        store = STORES["ros1"]
        types = store.types
        time = types["builtin_interfaces/msg/Time"](0, 0)
        goal = types["actionlib_msgs/msg/GoalID"](time, "g1")
        status = types["actionlib_msgs/msg/GoalStatus"](goal, 3, "done")
        header = types["std_msgs/msg/Header"](0, time, "")
        array = types["actionlib_msgs/msg/GoalStatusArray"](header, [status, status])
        data = written("ros1", array)
        type = "actionlib_msgs/GoalStatusArray"
        assert serialization.actionlib_in(data, 0, type, "ros1") == {
            "status_list": 2 * [{"goal_id": {"id": "g1"}, "status": 3, "text": "done"}]
        }

    def test_the_feedback_of_a_goal(self):
        type, data = actionlib(
            "Feedback",
            feedback={
                "base_position": {
                    "header": {"frame_id": "map"},
                    "pose": {"position": {"x": 1.0, "y": 2.0}},
                }
            },
        )
        found = serialization.actionlib_in(data, 0, type, "ros1")
        at = found["feedback"]["base_position"]
        assert at["header"] == {"frame_id": "map"}
        assert at["pose"]["position"] == {"x": 1.0, "y": 2.0}

    def test_the_result_of_a_goal(self):
        status = {"goal_id": {"id": "g1"}, "status": 4, "text": "lost"}
        type, data = actionlib("Result", status=status)
        found = serialization.actionlib_in(data, 0, type, "ros1")
        assert found == {"status": status}

    def test_another_type_is_left_out(self):
        assert serialization.actionlib_in(b"\1", 0, "std_msgs/Bool", "ros1") is None


GOAL_FIELDS = (Key("u", "t"), "r1", "g1", 1.0, 2.0, 0.0, "a")
