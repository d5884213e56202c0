"""The messages of the gate to a robot's ROS, and the parsing of the answers."""

import json
import math

import pytest
from link_bench import in_loop

from equipment.gate_harness import KEY, spec
from webmap.base.geometry import Twist
from webmap.gate.actions import SendGoal, SendPose
from webmap.gate.lanes import rosbridge
from webmap.gate.lanes.wires import wire_to


def decoded(data):
    return json.loads(data)


def goal_by(way, **changes):
    goal = SendGoal(KEY, "r1", "g1", 1.0, 2.0, math.pi, "a", way)
    if way == "navigate_to_pose":
        return decoded(rosbridge.action_goal(spec(**changes), goal))
    topic, _, message = rosbridge.goal_message(spec(**changes), goal)
    return {"op": "publish", "topic": topic, "msg": message}


@pytest.mark.parametrize(
    ("type", "stamp"),
    [
        ("geometry_msgs/TwistStamped", {"secs": 0, "nsecs": 0}),
        ("geometry_msgs/msg/TwistStamped", {"sec": 0, "nanosec": 0}),
    ],
)
def test_a_stamped_velocity_has_a_zero_stamp_in_the_format_of_its_ros_version(
    type, stamp
):
    velocity = rosbridge.velocity("/cmd_vel", type, Twist(0.5, 0.25, -1.0), "base")
    message = decoded(velocity)["msg"]
    assert message["header"] == {"stamp": stamp, "frame_id": "base"}
    assert message["twist"]["linear"] == {"x": 0.5, "y": 0.25, "z": 0.0}
    assert message["twist"]["angular"] == {"x": 0.0, "y": 0.0, "z": -1.0}


@pytest.mark.parametrize("type", ["Twist", "TwistStamped", "msg/TwistStamped"])
def test_a_velocity_has_all_six_numbers(type):
    twist = Twist(1.0, 2.0, 6.0, vz=3.0, wx=4.0, wy=5.0)
    message = decoded(rosbridge.velocity("/cmd_vel", f"geometry_msgs/{type}", twist))[
        "msg"
    ]
    message = message.get("twist", message)
    assert message["linear"] == {"x": 1.0, "y": 2.0, "z": 3.0}
    assert message["angular"] == {"x": 4.0, "y": 5.0, "z": 6.0}


def parsed_with(**changes):
    numbers = {"x": 1.0, "y": 2.0, "z": 3.0, "rx": 4.0, "ry": 5.0, "rz": 6.0, **changes}
    message = {
        "linear": {axis: numbers[axis] for axis in "xyz"},
        "angular": {axis: numbers[f"r{axis}"] for axis in "xyz"},
    }
    frame = {"op": "publish", "topic": "/odom", "msg": {"twist": {"twist": message}}}
    return rosbridge.parse(json.dumps(frame).encode()).twist


def test_odometry_is_read_with_all_six_numbers():
    assert parsed_with() == Twist(1.0, 2.0, 6.0, vz=3.0, wx=4.0, wy=5.0)


@pytest.mark.parametrize(("axis", "field"), [("z", "vz"), ("rx", "wx"), ("ry", "wy")])
@pytest.mark.parametrize("nothing", [None, math.nan])
def test_a_missing_number_outside_the_plane_is_read_as_nan(axis, field, nothing):
    twist = parsed_with(**{axis: nothing})
    assert math.isnan(getattr(twist, field))
    assert (twist.vx, twist.vy, twist.wz) == (1.0, 2.0, 6.0)


@pytest.mark.parametrize("axis", ["x", "y", "rz"])
def test_odometry_with_a_missing_number_in_the_plane_has_no_velocity(axis):
    assert parsed_with(**{axis: None}) is None


def test_a_plain_velocity_has_no_header():
    message = decoded(
        rosbridge.velocity("/cmd_vel", "geometry_msgs/Twist", Twist(0.5))
    )["msg"]
    assert message.keys() == {"linear", "angular"}


def test_a_topic_goal_is_published_as_a_pose():
    received = goal_by("topic", goal_frame="odom")
    assert (received["op"], received["topic"]) == ("publish", "/goal")
    assert received["msg"]["header"]["frame_id"] == "odom"
    assert received["msg"]["pose"]["position"] == {"x": 1.0, "y": 2.0, "z": 0.0}
    assert received["msg"]["pose"]["orientation"]["z"] == pytest.approx(1.0)


def test_a_move_base_goal_is_published_on_its_goal_topic():
    received = goal_by("move_base", action="/move_base")
    assert received["topic"] == "/move_base/goal"
    assert received["msg"]["goal_id"]["id"] == "g1"
    assert received["msg"]["goal"]["target_pose"]["header"]["frame_id"] == "map"


def test_an_action_goal_is_sent_with_send_action_goal():
    received = goal_by("navigate_to_pose", action="/go")
    assert (received["op"], received["id"], received["action"]) == (
        "send_action_goal",
        "g1",
        "/go",
    )
    assert received["args"]["pose"]["header"]["stamp"] == {"sec": 0, "nanosec": 0}


@in_loop
async def test_cancels_hooks_and_poses_are_encoded():
    wire = wire_to("ws://127.0.0.1:9", up=print, down=print, text=print)
    assert rosbridge.cancel_message("/cancel") == ("/cancel", rosbridge.GOAL_ID, {})
    cancel = decoded(wire.cancel_call("/go").hello)
    assert cancel["service"] == "/go/_action/cancel_goal"
    assert (cancel["type"], cancel["args"]) == (
        "action_msgs/srv/CancelGoal",
        {"goal_info": {}},
    )
    flag = rosbridge.flag("/lock", "std_msgs/Bool", True)
    assert flag == ("/lock", "std_msgs/Bool", {"data": True})
    call = decoded(wire.trigger_call("/e_stop", "std_srvs/Trigger").hello)
    assert (call["op"], call["service"], call["type"], call["args"]) == (
        "call_service",
        "/e_stop",
        "std_srvs/Trigger",
        {},
    )
    assert call["id"] != cancel["id"]
    wire.lane.close()
    located = spec(pose_topic="/initialpose", pose_covariance=(0.1, 0.2, 0.3))
    at = SendPose(KEY, "r1", 1.0, 2.0, 0.0, "a")
    topic, _, message = rosbridge.pose_estimate(located, at)
    assert topic == "/initialpose"
    covariance = message["pose"]["covariance"]
    assert (covariance[0], covariance[7], covariance[35]) == (0.1, 0.2, 0.3)


def frame(message, **more):
    fields = {"op": "publish", "topic": "/odom", "msg": message, **more}
    return json.dumps(fields).encode()


FLAT = {"linear": {"x": 0.5, "y": 0.0}, "angular": {"z": -1.0}}


@pytest.mark.parametrize("message", [FLAT, {"twist": FLAT}, {"twist": {"twist": FLAT}}])
def test_a_velocity_is_read_from_plain_stamped_and_odometry_messages(message):
    assert rosbridge.parse(frame(message)).twist == Twist(0.5, 0.0, -1.0)


@pytest.mark.parametrize(
    "message",
    [
        None,
        {},
        {"linear": {"x": None}, "angular": {}},
        {"linear": {"x": 1.0}},
        {"twist": {"twist": {"twist": FLAT}}},
        {"twist": None},
    ],
)
def test_a_message_without_a_valid_twist_has_no_velocity(message):
    assert rosbridge.parse(frame(message)).twist is None


def test_a_nan_in_json_is_parsed_but_is_not_a_velocity():
    seen = rosbridge.parse(frame({"linear": {"x": math.nan}, "angular": {"z": 0.0}}))
    assert (seen.topic, seen.twist) == ("/odom", None)


@pytest.mark.parametrize(
    "data", [b"", b"{", b"\xff", b"[]", b'{"op": 5}', b'{"op": NaN}']
)
def test_invalid_data_is_parsed_as_none(data):
    assert rosbridge.parse(data) is None


def test_a_numeric_id_is_converted_to_text():
    assert rosbridge.parse(b'{"op": "service_response", "id": 7}').id == "7"
    assert rosbridge.parse(b'{"op": "status"}').id is None
