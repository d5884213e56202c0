"""The rosbridge messages that the gate writes and reads. No I/O.

Messages of too many values or levels are refused: Python needs a tenth of a second for
a mebibyte of empty lists, and deep nesting exhausts its stack later.

A type ``package/msg/Name`` belongs to ROS 2, whose stamps have ``sec`` and ``nanosec``;
otherwise they have ``secs`` and ``nsecs``. The gate sends only stamps of zero: a robot
whose clock differs would refuse a command, or accept an old one as new.
"""

import json
import math
from functools import lru_cache
from typing import Any

import msgspec

from webmap.base.errors import ProtocolError
from webmap.base.geometry import Quaternion, Twist
from webmap.base.nesting import MAX_DEPTH
from webmap.gate.actions import SendGoal, SendPose
from webmap.gate.protocol import RobotSpec
from webmap.ros.decoding import check_depth
from webmap.ros.names import is_type
from webmap.ros.rosbridge import ops

MOST_KEPT, SHORT = 4096, 512
"""How many velocities and how many echoes are kept, because zeros repeat; an echo is
kept if it is short, in bytes."""

MOST_PARTS = 20_000
"""The most values in a message. A dense scan in JSON has 7,200, any message that the
gate subscribes to in JSON a few hundred."""


def check_parts(data: bytes) -> None:
    """Check that a message does not hold too many values.

    Raises:
        ProtocolError: If it does.

    """
    if len(data) <= MOST_PARTS:
        return
    # Each value but the first follows one of these; texts may contain them, too.
    parts = sum(map(data.count, (b"[", b"{", b",")))
    if parts > MOST_PARTS:
        raise ProtocolError(
            f"a message of about {parts} values was sent where at most {MOST_PARTS} "
            "are read"
        )


def too_deep() -> ProtocolError:
    """Return the error for a message that is nested too deeply."""
    return ProtocolError(f"a message nested deeper than {MAX_DEPTH} levels")


def plain(data: bytes) -> Any:
    """Return the JSON value of a message, which may have the bare NaN of some bridges.

    Raises:
        ProtocolError: If it holds too many values or is nested too deeply.
        ValueError: If it is not JSON.

    """
    check_parts(data)
    try:
        value = json.loads(data)
    except RecursionError:
        raise too_deep() from None
    check_depth(value)
    return value


def velocity_message(type: str, twist: Twist, frame: str) -> dict[str, Any]:
    """Return the fields of a velocity, in the frame of the base.

    The stamp of a TwistStamped is zero. A base compares the stamp with its own clock: a
    stamp from a clock that is ahead would disable the base's timeout.
    """
    message: dict[str, Any] = twist.to_message()
    if is_type(type, "geometry_msgs/TwistStamped"):
        message = {"header": _header(type, frame), "twist": message}
    return message


@lru_cache(maxsize=MOST_KEPT)
def velocity(topic: str, type: str, twist: Twist, frame: str = "") -> bytes:
    """Return the operation that publishes a velocity, in the frame of the base."""
    return ops.publish(topic, velocity_message(type, twist, frame))


Message = tuple[str, str, dict[str, Any]]
"""A topic, its type, and the fields of a message."""

GOAL_ID = "actionlib_msgs/GoalID"
EVERY_GOAL = {"stamp": {"secs": 0, "nsecs": 0}, "id": ""}
"""The fields of an empty ``GOAL_ID``, which JSON may leave out."""

MOVE_BASE_GOAL = "move_base_msgs/MoveBaseActionGoal"


def goal_message(spec: RobotSpec, goal: SendGoal) -> Message:
    """Return the message that sends the robot to a goal, unless it is an action."""
    if goal.method == "topic":
        type = spec.goal_type("PoseStamped")
        return spec.navigation.topic, type, _stamped(type, spec, _pose(goal))
    target = _stamped("geometry_msgs/PoseStamped", spec, _pose(goal))
    message = {
        "header": _header("", ""),
        "goal_id": {"stamp": {"secs": 0, "nsecs": 0}, "id": goal.id},
        "goal": {"target_pose": target},
    }
    return f"{spec.navigation.action}/goal", MOVE_BASE_GOAL, message


def action_fields(spec: RobotSpec, goal: SendGoal) -> dict[str, Any]:
    """Return the fields of a goal of the robot's action."""
    pose = _stamped("geometry_msgs/msg/PoseStamped", spec, _pose(goal))
    return {"pose": pose, "behavior_tree": ""}


def action_goal(spec: RobotSpec, goal: SendGoal) -> bytes:
    """Return the operation that sends the robot to a goal of its action."""
    return json.dumps(
        {
            "op": "send_action_goal",
            "id": goal.id,
            "action": spec.navigation.action,
            "action_type": spec.navigation.action_type,
            "args": action_fields(spec, goal),
            "feedback": True,
        },
        allow_nan=False,
    ).encode()


def cancel_message(topic: str) -> Message:
    """Return the message that cancels every goal of an actionlib server."""
    return topic, GOAL_ID, {}


def flag(topic: str, type: str, value: bool) -> Message:
    """Return the message with a Bool."""
    return topic, type, {"data": value}


def pose_estimate(spec: RobotSpec, at: SendPose) -> Message:
    """Return the message that sends the robot its pose."""
    assert spec.initial_pose is not None  # the rules checked it
    covariance = [0.0] * 36
    covariance[0], covariance[7], covariance[35] = spec.initial_pose.covariance
    pose = {"pose": _pose(at), "covariance": covariance}
    type = spec.goal_type("PoseWithCovarianceStamped")
    return spec.initial_pose.topic, type, _stamped(type, spec, pose)


def _pose(at: SendGoal | SendPose) -> dict[str, Any]:
    q = Quaternion.from_yaw(at.yaw)
    return {
        "position": {"x": at.x, "y": at.y, "z": 0.0},
        "orientation": {"x": q.x, "y": q.y, "z": q.z, "w": q.w},
    }


def _stamped(type: str, spec: RobotSpec, pose: dict[str, Any]) -> dict[str, Any]:
    return {"header": _header(type, spec.goal_frame), "pose": pose}


def _header(type: str, frame: str) -> dict[str, Any]:
    ros2 = "/msg/" in type
    stamp = {"sec": 0, "nanosec": 0} if ros2 else {"secs": 0, "nsecs": 0}
    return {"stamp": stamp, "frame_id": frame}


class _Vector(msgspec.Struct):
    x: float | None = 0.0
    y: float | None = 0.0
    z: float | None = 0.0


class _Twist(msgspec.Struct):
    """A Twist, or a message that contains one: TwistStamped, Odometry."""

    linear: _Vector | None = None
    angular: _Vector | None = None
    twist: "_Twist | None" = None


class _Frame(msgspec.Struct):
    op: str = ""
    id: str | int | None = None
    topic: str | None = None
    msg: _Twist | None = None


_decode_frame = msgspec.json.Decoder(_Frame).decode


class Received(msgspec.Struct, frozen=True):
    """The parts of a bridge's message that the gate uses."""

    op: str
    id: str | None
    topic: str | None
    twist: Twist | None
    """The velocity in a published message, if there is one and its motion in the plane
    has finite numbers only. The other numbers are NaN where the message has none."""


def parse(data: bytes) -> Received | None:
    """Return the parts of a bridge's message; ``None`` if it is invalid.

    Raises:
        ProtocolError: If it holds too many values or is nested too deeply.

    """
    check_parts(data)
    frame: _Frame | None
    try:
        frame = _decode_frame(data)
    except RecursionError:
        raise too_deep() from None
    except ValueError:
        frame = _lenient(data)
    if frame is None:
        return None
    id = None if frame.id is None else str(frame.id)
    return Received(frame.op, id, frame.topic, _velocity(frame.msg))


def parse_echo(data: bytes) -> Received | None:
    """Return the parts of an echo, as :func:`parse`."""
    return _parse_short(data) if len(data) <= SHORT else parse(data)


_parse_short = lru_cache(maxsize=MOST_KEPT)(parse)


def _lenient(data: bytes) -> _Frame | None:
    """Read JSON with the bare NaN that some bridges write."""
    try:
        return msgspec.convert(plain(data), _Frame)
    except ValueError:  # msgspec's own errors are of that kind too
        return None


def _velocity(message: _Twist | None) -> Twist | None:
    for _ in range(3):  # Odometry has a TwistWithCovariance, which has a Twist
        if message is None:
            return None
        if message.linear is not None and message.angular is not None:
            linear, angular = message.linear, message.angular
            plane = (linear.x, linear.y, angular.z)
            if any(part is None or not math.isfinite(part) for part in plane):
                return None
            # Whether the other numbers matter depends on the robot.
            found = (*plane, linear.z, angular.x, angular.y)
            return Twist(*(math.nan if part is None else part for part in found))
        message = message.twist
    return None
