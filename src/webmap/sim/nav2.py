"""ROS 2's navigate_to_pose action for one robot, and its cancel service."""

import uuid
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from webmap.sim.navigator import Goal, GoalState
from webmap.sim.rosbridge.graph import GoalHandle, Respond

if TYPE_CHECKING:
    from webmap.sim.node import RobotsNode

_STATUS = {
    GoalState.SUCCEEDED: 4,
    GoalState.CANCELED: 5,
    GoalState.ABORTED: 6,
}
_UNKNOWN_STATUS = 0
_FAILED = 9000
_NOBODY = bytes(16)
_ERROR_NONE, _ERROR_REJECTED, _ERROR_UNKNOWN_GOAL = 0, 1, 2

OnFeedback = Callable[[dict[str, Any]], None]
OnResult = Callable[[int, dict[str, Any]], None]


class NavigateToPose:
    """Takes goals from sockets, each with a handle that only its sender has."""

    type = "nav2_msgs/NavigateToPose"

    def __init__(self, node: "RobotsNode", index: int, prefix: str) -> None:
        self.node = node
        self.index = index
        self.action = f"{prefix}/navigate_to_pose"
        self._running: dict[bytes, _Handle] = {}

    def start(self) -> None:
        """Put the action and its cancel service into the graph."""
        self.node.graph.actions[self.action] = self
        self.node.graph.serve(
            self.node,
            f"{self.action}/_action/cancel_goal",
            "action_msgs/CancelGoal",
            self._on_cancel,
            node="/robots",
        )
        self.node.graph.advertise(
            self.node,
            f"{self.action}/_action/feedback",
            f"{self.type}_FeedbackMessage",
            node="/robots",
        )
        self.node.on_step.append(self._publish_feedback)

    def send_goal(
        self, goal: dict[str, Any], on_feedback: OnFeedback, on_result: OnResult
    ) -> GoalHandle:
        """Drive to a goal; the one before ends as canceled."""
        handle = _Handle(self, on_feedback, on_result, self.node.world.now)
        target = self.node.target(goal["pose"], self.index)
        if target is None:
            on_result(_UNKNOWN_STATUS, _result("the goal is in no known frame"))
            return handle
        handle.goal = Goal(target, handle.end)
        self._running[handle.uuid] = handle
        self.node.world.send_goal(self.index, handle.goal)
        return handle

    def forget(self, handle: "_Handle") -> None:
        """Let go of a goal that ended."""
        self._running.pop(handle.uuid, None)

    def _on_cancel(self, request: dict[str, Any], respond: Respond) -> None:
        info = request["goal_info"]
        wanted = info["goal_id"]["uuid"]
        chosen = [h for h in self._running.values() if wanted in (_NOBODY, h.uuid)]
        stamp = self.node.graph.schema.dialect.time(0)
        canceling = [
            {"goal_id": {"uuid": handle.uuid}, "stamp": stamp} for handle in chosen
        ]
        code = _ERROR_NONE
        if not chosen:
            code = _ERROR_REJECTED if wanted == _NOBODY else _ERROR_UNKNOWN_GOAL
        if wanted == _NOBODY:
            # What came by a topic ends too.
            self.node.world.navigators[self.index].cancel("canceled")
        for handle in chosen:
            handle.cancel()
        respond({"return_code": code, "goals_canceling": canceling})

    def _publish_feedback(self) -> None:
        world = self.node.world
        navigator = world.navigators[self.index]
        for handle in self._running.values():
            left = navigator.distance_left
            time = self.node.graph.schema.dialect.time
            now = self.node.graph.clock()
            pose = world.robots[self.index].pose
            feedback = {
                "current_pose": self.node.messages.pose_stamped(now, pose),
                "navigation_time": time(world.now - handle.started_at),
                "estimated_time_remaining": time(left / 0.6),
                "number_of_recoveries": navigator.recoveries,
                "distance_remaining": left,
            }
            handle.on_feedback(feedback)
            message = {"goal_id": {"uuid": handle.uuid}, "feedback": feedback}
            self.node.publish(f"{self.action}/_action/feedback", message)


class _Handle:
    def __init__(
        self,
        server: NavigateToPose,
        on_feedback: OnFeedback,
        on_result: OnResult,
        started_at: float,
    ) -> None:
        self.uuid = uuid.uuid4().bytes
        self.goal: Goal | None = None
        self.on_feedback = on_feedback
        self.started_at = started_at
        self._server = server
        self._on_result = on_result

    def cancel(self) -> None:
        navigator = self._server.node.world.navigators[self._server.index]
        if self.goal is not None and navigator.goal is self.goal:
            navigator.cancel("canceled")

    def end(self, goal: Goal) -> None:
        self._server.forget(self)
        failed = goal.state is GoalState.ABORTED
        result = _result(goal.text if failed else "")
        self._on_result(_STATUS[goal.state], result)


def _result(error: str) -> dict[str, Any]:
    return {"error_code": _FAILED if error else 0, "error_msg": error}
