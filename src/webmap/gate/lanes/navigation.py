"""What the answers of a bridge to goals and service calls mean. No I/O.

A ``NavigateToPose`` action answers on the socket that sent the goal, by
``action_feedback`` and ``action_result``. move_base answers on three topics of
actionlib, each message with the id of the goal. A message about another goal, or an
invalid one, is ignored.
"""

import math
from typing import Any, NamedTuple, TypeVar

import msgspec

from webmap.gate.actions import SendGoal
from webmap.gate.events import GoalEnded, GoalProgress, Outcome
from webmap.gate.lanes.rosbridge import plain
from webmap.gate.protocol import RobotSpec

GoalNews = GoalProgress | GoalEnded
T = TypeVar("T")

MOST_WORDS = 200
"""The longest reason that is reported, in characters."""

_ROS2: dict[int, Outcome] = {4: "reached", 5: "cancelled", 6: "failed"}
_ACTIONLIB: dict[int, Outcome] = {
    2: "cancelled",
    3: "reached",
    4: "failed",
    5: "failed",
    8: "cancelled",
    9: "failed",
}
_ACTIONLIB_WAITING, _ACTIONLIB_ACTIVE = (0, 7), (1, 6)
_ACTIONLIB_REASONS = {5: "the robot refused the goal", 9: "the robot lost the goal"}


class _Duration(msgspec.Struct):
    """A duration of ROS 2; move_base reports none."""

    sec: float = 0.0
    nanosec: float = 0.0

    @property
    def seconds(self) -> float:
        return self.sec + self.nanosec * 1e-9


class _Header(msgspec.Struct):
    frame_id: str = ""


class _Position(msgspec.Struct):
    x: float | None = None
    y: float | None = None


class _Pose(msgspec.Struct):
    position: _Position = msgspec.field(default_factory=_Position)


class _PoseStamped(msgspec.Struct):
    header: _Header = msgspec.field(default_factory=_Header)
    pose: _Pose = msgspec.field(default_factory=_Pose)


class _Feedback(msgspec.Struct):
    """The feedback of either action."""

    distance_remaining: float | None = None
    navigation_time: _Duration | None = None
    estimated_time_remaining: _Duration | None = None
    number_of_recoveries: int | None = None
    base_position: _PoseStamped | None = None


class _GoalId(msgspec.Struct):
    id: str = ""


class _Status(msgspec.Struct):
    goal_id: _GoalId = msgspec.field(default_factory=_GoalId)
    status: int = -1
    text: str = ""


class _ActionlibMessage(msgspec.Struct):
    """A message of one of actionlib's three topics."""

    status: _Status | None = None
    status_list: list[_Status] = []
    feedback: _Feedback | None = None


class _Result(msgspec.Struct):
    error_code: int = 0
    error_msg: str = ""


class _GoalFrame(msgspec.Struct):
    op: str = ""
    id: str | int | None = None
    topic: str = ""
    level: str = ""
    status: int | None = None
    values: Any = None
    msg: Any = None


def of_action(data: bytes, goal: SendGoal) -> GoalNews | None:
    """Return the news of a goal in a message on the socket that sent it as an action.

    Raises:
        ProtocolError: If it holds too many values or is nested too deeply.

    """
    frame = _read(data)
    if frame is None:
        return None
    if frame.op == "status" and frame.level == "error":
        return _complaint(str(frame.msg), goal)
    if frame.id is None or str(frame.id) != goal.id:
        return None
    if frame.op == "action_feedback":
        return of_feedback(frame.values, goal)
    if frame.op != "action_result":
        return None
    return of_result(frame.status or 0, frame.values, goal)


def of_feedback(fields: Any, goal: SendGoal) -> GoalProgress | None:
    """Return the progress of a goal from the feedback of its action."""
    feedback = _as(fields, _Feedback)
    return None if feedback is None else _progress(feedback, goal, "")


def of_result(status: int, fields: Any, goal: SendGoal) -> GoalEnded:
    """Return the end of a goal.

    Args:
        status: A status of ``action_msgs/GoalStatus``.
        fields: The fields of the action's result, or the reason as text.
        goal: The goal.

    """
    outcome = _ROS2.get(status, "failed")
    if isinstance(fields, str):
        return _ended(goal, outcome, fields)
    result = _as(fields, _Result) or _Result()
    why = result.error_msg
    if not why and result.error_code:
        why = f"error {result.error_code}"
    return _ended(goal, outcome, why)


def of_topics(data: bytes, spec: RobotSpec, goal: SendGoal) -> GoalNews | None:
    """Return the news of a goal in a message from one of move_base's topics.

    Raises:
        ProtocolError: If it holds too many values or is nested too deeply.

    """
    frame = _read(data)
    if frame is None or frame.op != "publish":
        return None
    return of_message(frame.topic, frame.msg, spec, goal)


def of_message(
    topic: str, fields: Any, spec: RobotSpec, goal: SendGoal
) -> GoalNews | None:
    """Return the news of a goal in a message from one of move_base's topics."""
    part = topic.removeprefix(f"{spec.navigation.action}/")
    message = _as(fields, _ActionlibMessage)
    if message is None or part not in ("status", "feedback", "result"):
        return None
    if part == "status":
        ours = [each for each in message.status_list if each.goal_id.id == goal.id]
        return _of_status(ours[0], goal) if ours else None
    if message.status is None or message.status.goal_id.id != goal.id:
        return None
    if part == "result":
        return _of_status(message.status, goal)
    return _progress(message.feedback or _Feedback(), goal, spec.goal_frame)


def _of_status(status: _Status, goal: SendGoal) -> GoalNews | None:
    outcome = _ACTIONLIB.get(status.status)
    if outcome is not None:
        why = status.text or _ACTIONLIB_REASONS.get(status.status, "")
        return _ended(goal, outcome, "" if outcome == "reached" else why)
    if status.status in _ACTIONLIB_ACTIVE + _ACTIONLIB_WAITING:
        active = status.status in _ACTIONLIB_ACTIVE
        return GoalProgress(goal.robot, goal.id, active=active)
    return None


def _progress(feedback: _Feedback, goal: SendGoal, frame: str) -> GoalProgress:
    left, eta = feedback.distance_remaining, feedback.estimated_time_remaining
    at, time = feedback.base_position, feedback.navigation_time
    if at is not None and at.header.frame_id.strip("/") == frame.strip("/"):
        place = at.pose.position
        if place.x is not None and place.y is not None:
            left = math.dist((place.x, place.y), (goal.x, goal.y))
    return GoalProgress(
        goal.robot,
        goal.id,
        active=True,
        left=_sensible(left),
        time=_sensible(None if time is None else time.seconds),
        eta=_sensible(None if eta is None else eta.seconds),
        recoveries=_countable(feedback.number_of_recoveries),
    )


def _sensible(number: float | None) -> float | None:
    """Return a number rounded for display, None if it cannot be shown."""
    if number is None or not math.isfinite(number) or number < 0:
        return None
    return round(number, 1)


def _countable(number: int | None) -> int | None:
    """Return a count, None if no robot could count this far.

    Robots write numbers of any length, and the pipe to the display carries 64 bits.
    """
    return number if number is not None and 0 <= number < 2**31 else None


def _complaint(text: str, goal: SendGoal) -> GoalEnded | None:
    """Return the failure of the goal, if the bridge's error is about a goal."""
    if "send_action_goal" not in text:
        return None
    if "unknown operation" in text.lower():
        why = "the bridge does not support goals of actions"
        return GoalEnded(goal.robot, goal.id, "failed", why, no_actions=True)
    return _ended(goal, "failed", text)


def _ended(goal: SendGoal, outcome: Outcome, why: str) -> GoalEnded:
    return GoalEnded(goal.robot, goal.id, outcome, readable(why))


def readable(text: str) -> str:
    """Return a robot's text for display: short, printable, on one line."""
    # Cut first: a pass over each character of a megabyte would delay zeros.
    plain = " ".join(text[: 10 * MOST_WORDS].split())
    return "".join(letter for letter in plain if letter.isprintable())[:MOST_WORDS]


def _read(data: bytes) -> _GoalFrame | None:
    try:
        # Bridges write a bare NaN, which msgspec refuses.
        value = plain(data)
    except ValueError:
        return None
    return _as(value, _GoalFrame)


def _as(value: Any, type: type[T]) -> T | None:
    try:
        return msgspec.convert(value, type)
    except ValueError:  # msgspec's own errors, and that of half a surrogate pair
        return None


class CallResult(NamedTuple):
    """The outcome of a service call."""

    why: str | None
    """Why the call failed; ``None`` if it did not."""


class _ServiceFrame(msgspec.Struct):
    op: str = ""
    id: str | int | None = None
    result: Any = None
    values: Any = None
    level: str = ""
    msg: Any = None


def answer_to(data: bytes, id: str) -> CallResult | None:
    """Return the answer to the call ``id`` in a message; ``None`` if it has none.

    A call has failed only if the answer states so: old bridges leave out ``result``,
    and a service of another type than Trigger has no ``success``.

    Raises:
        ProtocolError: If it holds too many values or is nested too deeply.

    """
    try:
        frame = msgspec.convert(plain(data), _ServiceFrame)
    except ValueError:  # msgspec's own errors are of that kind too
        return None
    if str(frame.id) != id:
        return None
    if frame.op == "status" and frame.level == "error":
        return CallResult(because("refused", frame.msg))
    if frame.op != "service_response":
        return None
    if frame.result is False:
        return CallResult(because("refused", frame.values))
    values = frame.values
    if isinstance(values, dict) and values.get("success") is False:
        return CallResult(
            because("the service reported a failure", values.get("message"))
        )
    return CallResult(None)


def because(what: str, text: Any) -> str:
    """Return why a call failed, with the words of the bridge or the service."""
    details = readable(text) if isinstance(text, str) else ""
    return f"{what} ({details})" if details else what
