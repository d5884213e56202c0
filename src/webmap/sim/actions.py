"""Goals: ROS 1's move_base action through topics, and ROS 2's navigate_to_pose."""

import uuid
from collections.abc import Callable
from typing import Any

from webmap.ros.rosbridge.server.encode import Publication
from webmap.ros.rosbridge.server.graph import GoalHandle, Respond
from webmap.sim.messages import NODE, GraphNode
from webmap.sim.navigator import GoalState, SimGoal

_ACTIONLIB_STATUS = {
    GoalState.ACTIVE: 1,
    GoalState.CANCELED: 2,
    GoalState.SUCCEEDED: 3,
    GoalState.ABORTED: 4,
}
_REJECTED = 5
_KEPT = 5.0
"""Seconds for which an ended goal stays in the status, as in actionlib."""


class _Tracked:
    def __init__(self, goal_id: dict[str, Any], goal: SimGoal | None) -> None:
        self.goal_id = goal_id
        self.goal = goal
        self.ended_at: float | None = None

    def status(self) -> dict[str, Any]:
        number = _ACTIONLIB_STATUS[self.goal.state] if self.goal else _REJECTED
        text = self.goal.text if self.goal else "the goal is in no known frame"
        return {"goal_id": self.goal_id, "status": number, "text": text}


class ActionlibServer:
    """Receives goals and cancels by topic, and publishes their progress."""

    def __init__(self, node: GraphNode, index: int, prefix: str) -> None:
        self.node = node
        self.index = index
        self.topic = f"{prefix}/move_base"
        self._goals: list[_Tracked] = []
        self._made = 0

    def start(self) -> None:
        """Advertise and subscribe to the topics."""
        node, kind = self.node, "move_base_msgs/MoveBaseAction"
        for part, type_name in (
            ("status", "actionlib_msgs/GoalStatusArray"),
            ("result", f"{kind}Result"),
            ("feedback", f"{kind}Feedback"),
        ):
            node.advertise(f"{self.topic}/{part}", type_name)
        node.subscribe(f"{self.topic}/goal", f"{kind}Goal", self._on_goal)
        cancel = f"{self.topic}/cancel"
        node.subscribe(cancel, "actionlib_msgs/GoalID", self._on_cancel)
        node.on_step.append(self.publish_status)

    def publish_status(self) -> None:
        """Publish the status of the goals, and the feedback of the active one."""
        now = self.node.graph.clock()
        self._goals = [
            tracked
            for tracked in self._goals
            if tracked.ended_at is None or now - tracked.ended_at < _KEPT
        ]
        topic = f"{self.topic}/status"
        if self.node.graph.is_wanted(topic):
            header = self.node.graph.schema.dialect.header(topic, now, "")
            statuses = [tracked.status() for tracked in self._goals]
            self.node.publish(topic, {"header": header, "status_list": statuses})
        for tracked in self._goals:
            if tracked.ended_at is None:
                self._publish_feedback(tracked, now)

    def _on_goal(self, publication: Publication) -> None:
        message = publication.message
        target = self.node.target(message["goal"]["target_pose"], self.index)
        goal_id = self._identify(message["goal_id"])
        if any(tracked.goal_id["id"] == goal_id["id"] for tracked in self._goals):
            return  # actionlib ignores a goal whose id is in its status
        if target is None:
            tracked = _Tracked(goal_id, None)
            self._goals.append(tracked)
            self._end(tracked)
            return
        goal = SimGoal(target, lambda _: self._end(tracked))
        tracked = _Tracked(goal_id, goal)
        self._goals.append(tracked)
        self.node.world.send_goal(self.index, goal)

    def _identify(self, goal_id: dict[str, Any]) -> dict[str, Any]:
        if goal_id["id"]:
            return goal_id
        self._made += 1
        now = self.node.graph.clock()
        stamp = self.node.graph.schema.dialect.time(now)
        return {"stamp": stamp, "id": f"{self.topic}-{self._made}-{now:.3f}"}

    def _on_cancel(self, publication: Publication) -> None:
        self.node.world.pause_errands(self.index)
        goal_id, stamp = publication.message["id"], publication.message["stamp"]
        before = _seconds(stamp)
        for tracked in self._goals:
            # An empty id with a stamp: all goals up to it. No stamp: all goals.
            everything = not goal_id and not before
            earlier = before and _seconds(tracked.goal_id["stamp"]) <= before
            if everything or earlier or (goal_id and tracked.goal_id["id"] == goal_id):
                self._cancel(tracked)
        if not goal_id and not before:
            # A goal from the simple topic ends too.
            self.node.world.navigators[self.index].cancel("canceled")

    def _cancel(self, tracked: _Tracked) -> None:
        navigator = self.node.world.navigators[self.index]
        if tracked.goal is not None and navigator.goal is tracked.goal:
            navigator.cancel("canceled")

    def _end(self, tracked: _Tracked) -> None:
        now = self.node.graph.clock()
        tracked.ended_at = now
        topic = f"{self.topic}/result"
        header = self.node.graph.schema.dialect.header(topic, now, "")
        result = {"header": header, "status": tracked.status(), "result": {}}
        self.node.publish(topic, result)

    def _publish_feedback(self, tracked: _Tracked, now: float) -> None:
        topic = f"{self.topic}/feedback"
        if not self.node.graph.is_wanted(topic):
            return
        pose = self.node.world.robots[self.index].pose
        header = self.node.graph.schema.dialect.header(topic, now, "")
        base = {"base_position": self.node.messages.pose_stamped(now, pose)}
        feedback = {"header": header, "status": tracked.status(), "feedback": base}
        self.node.publish(topic, feedback)


def _seconds(stamp: dict[str, int]) -> float:
    whole, rest = stamp.values()
    return whole + rest * 1e-9


_NAV2_STATUS = {
    GoalState.SUCCEEDED: 4,
    GoalState.CANCELED: 5,
    GoalState.ABORTED: 6,
}
_FAILED = 9000
_ALL_GOALS = bytes(16)
_ERROR_NONE, _ERROR_REJECTED, _ERROR_UNKNOWN_GOAL = 0, 1, 2

OnFeedback = Callable[[dict[str, Any]], None]
OnResult = Callable[[int, dict[str, Any]], None]


class NavigateToPose:
    """Receives goals from sockets, each with a handle for its sender only."""

    type = "nav2_msgs/NavigateToPose"

    def __init__(self, node: GraphNode, index: int, prefix: str) -> None:
        self.node = node
        self.index = index
        self.action = f"{prefix}/navigate_to_pose"
        self._running: dict[bytes, _Handle] = {}

    def start(self) -> None:
        """Register the action and its cancel service in the graph."""
        self.node.graph.actions[self.action] = self
        self.node.graph.serve(
            self.node,
            f"{self.action}/_action/cancel_goal",
            "action_msgs/CancelGoal",
            self._on_cancel,
            node=NODE,
        )
        feedback = f"{self.action}/_action/feedback"
        self.node.advertise(feedback, f"{self.type}_FeedbackMessage")
        self.node.on_step.append(self._publish_feedback)

    def send_goal(
        self, goal: dict[str, Any], on_feedback: OnFeedback, on_result: OnResult
    ) -> GoalHandle | None:
        """Drive to a goal; the previous one ends as canceled.

        A goal in a frame that the robot does not know is rejected.
        """
        target = self.node.target(goal["pose"], self.index)
        if target is None:
            return None
        handle = _Handle(self, on_feedback, on_result, self.node.world.now)
        handle.goal = SimGoal(target, handle.end)
        self._running[handle.uuid] = handle
        self.node.world.send_goal(self.index, handle.goal)
        return handle

    def forget(self, handle: "_Handle") -> None:
        """Remove an ended goal."""
        self._running.pop(handle.uuid, None)

    def _on_cancel(self, request: dict[str, Any], respond: Respond) -> None:
        self.node.world.pause_errands(self.index)
        info = request["goal_info"]
        goal_id = info["goal_id"]["uuid"]
        chosen = [h for h in self._running.values() if goal_id in (_ALL_GOALS, h.uuid)]
        stamp = self.node.graph.schema.dialect.time(0)
        canceling = [
            {"goal_id": {"uuid": handle.uuid}, "stamp": stamp} for handle in chosen
        ]
        code = _ERROR_NONE
        if not chosen:
            code = _ERROR_REJECTED if goal_id == _ALL_GOALS else _ERROR_UNKNOWN_GOAL
        if goal_id == _ALL_GOALS:
            # A goal from a topic ends too.
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
        self.goal: SimGoal | None = None
        self.on_feedback = on_feedback
        self.started_at = started_at
        self._server = server
        self._on_result = on_result

    def cancel(self) -> None:
        navigator = self._server.node.world.navigators[self._server.index]
        if self.goal is not None and navigator.goal is self.goal:
            navigator.cancel("canceled")

    def end(self, goal: SimGoal) -> None:
        self._server.forget(self)
        failed = goal.state is GoalState.ABORTED
        result = _result(goal.text if failed else "")
        self._on_result(_NAV2_STATUS[goal.state], result)


def _result(error: str) -> dict[str, Any]:
    return {"error_code": _FAILED if error else 0, "error_msg": error}
