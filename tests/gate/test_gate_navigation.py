"""Messages of robots about their goals, of ROS 1 and ROS 2, and other messages."""

import json

import pytest

from equipment.declarations import declared
from webmap.gate import pipe
from webmap.gate.actions import SendGoal
from webmap.gate.events import GoalEnded, GoalProgress, Key
from webmap.gate.lanes import navigation

KEY = Key("ws://robot:9090", "/cmd_vel")
SPEC = declared(
    id="r1",
    name="Bob",
    bridge_url=KEY.url,
    action="/move_base",
    action_type="move_base_msgs/MoveBaseAction",
)


def goal(way):
    return SendGoal(KEY, "r1", "g1", 3.0, 4.0, 0.0, "a", way)


def of_action(text=None, **frame):
    data = (text or json.dumps(frame)).encode()
    return navigation.of_action(data, goal("navigate_to_pose"))


def of_topics(part, msg, **frame):
    fields = {"op": "publish", "topic": f"/move_base/{part}", "msg": msg, **frame}
    return navigation.of_topics(json.dumps(fields).encode(), SPEC, goal("move_base"))


class TestAction:
    def feedback(self, **values):
        return of_action(op="action_feedback", id="g1", values=values)

    def result(self, status, values=None, **frame):
        fields = {"op": "action_result", "id": "g1", "status": status, "result": True}
        return of_action(**{**fields, "values": values or {}, **frame})

    def test_action_feedback_gives_distance_times_and_recoveries(self):
        assert self.feedback(
            distance_remaining=3.26,
            navigation_time={"sec": 4, "nanosec": 500000000},
            estimated_time_remaining={"sec": 6, "nanosec": 0},
            number_of_recoveries=2,
            current_pose={"header": {"frame_id": "map"}},
        ) == GoalProgress("r1", "g1", True, left=3.3, time=4.5, eta=6.0, recoveries=2)

    def test_nan_and_negative_numbers_in_feedback_are_left_out(self):
        event = of_action(
            '{"op": "action_feedback", "id": "g1", "values": '
            '{"distance_remaining": NaN, "estimated_time_remaining": {"sec": -1}}}'
        )
        assert event == GoalProgress("r1", "g1", True)

    @pytest.mark.parametrize("number", [-1, 2**31, 10**30, 10**400])
    def test_recovery_counts_out_of_range_are_left_out(self, number):
        event = self.feedback(number_of_recoveries=number)
        assert event == GoalProgress("r1", "g1", True)
        assert pipe.pack(event)

    def test_feedback_with_a_time_too_large_for_a_float_is_ignored(self):
        assert self.feedback(navigation_time={"sec": 10**400, "nanosec": 0}) is None

    @pytest.mark.parametrize(
        ("status", "values", "outcome", "why"),
        [
            (4, {}, "reached", ""),
            (5, {}, "cancelled", ""),
            (6, {"error_code": 208, "error_msg": "no  path\n"}, "failed", "no path"),
            (6, {"error_code": 208, "error_msg": ""}, "failed", "error 208"),
            (6, {"result": {}}, "failed", ""),
            (0, "Action goal was rejected", "failed", "Action goal was rejected"),
            (None, [1], "failed", ""),
        ],
    )
    def test_an_action_result_ends_the_goal(self, status, values, outcome, why):
        assert self.result(status, values) == GoalEnded("r1", "g1", outcome, why)

    def test_a_failure_reason_is_shortened_and_has_no_control_characters(self):
        end = self.result(6, {"error_msg": "\x1b[31m" + "x" * 999})
        assert end.why.startswith("[31mx")
        assert len(end.why) == navigation.MOST_WORDS

    def test_a_bridge_without_action_support_is_recognized(self):
        message = "Unknown operation: send_action_goal.  Allowed operations: [...]"
        end = of_action(op="status", level="error", msg=message)
        assert end.outcome == "failed"
        assert end.no_actions
        message = "send_action_goal: wrong type"
        end = of_action(op="status", level="error", msg=message)
        assert end == GoalEnded("r1", "g1", "failed", message)

    @pytest.mark.parametrize(
        "frame",
        [
            {"op": "status", "level": "error", "msg": "something else"},
            {"op": "status", "level": "warning", "msg": "send_action_goal"},
            {"op": "action_result", "id": "g2", "status": 4},
            {"op": "action_result", "status": 4},
            {"op": "action_feedback", "id": "g1", "values": "text"},
            {"op": "publish", "id": "g1"},
            {"op": 7},
        ],
    )
    def test_unrelated_messages_are_ignored(self, frame):
        assert of_action(**frame) is None

    @pytest.mark.parametrize("text", ["{", "[]", "7"])
    def test_messages_that_are_not_json_objects_are_ignored(self, text):
        assert of_action(text) is None


class TestTopics:
    def status(self, status, text="", id="g1"):
        return {"goal_id": {"id": id}, "status": status, "text": text}

    @pytest.mark.parametrize(
        ("status", "active"), [(0, False), (1, True), (6, True), (7, False)]
    )
    def test_the_move_base_status_gives_whether_the_goal_is_active(
        self, status, active
    ):
        others = self.status(3, id="g0")
        event = of_topics("status", {"status_list": [others, self.status(status)]})
        assert event == GoalProgress("r1", "g1", active)

    @pytest.mark.parametrize(
        ("status", "text", "outcome", "why"),
        [
            (2, "preempted", "cancelled", "preempted"),
            (3, "Goal reached.", "reached", ""),
            (4, "no path to the goal", "failed", "no path to the goal"),
            (5, "", "failed", "the robot refused the goal"),
            (8, "", "cancelled", ""),
            (9, "", "failed", "the robot lost the goal"),
        ],
    )
    def test_a_move_base_status_or_result_ends_the_goal(
        self, status, text, outcome, why
    ):
        end = GoalEnded("r1", "g1", outcome, why)
        message = self.status(status, text)
        assert of_topics("status", {"status_list": [message]}) == end
        assert of_topics("result", {"status": message, "result": {}}) == end

    def test_move_base_feedback_gives_the_straight_line_distance_to_the_goal(self):
        place = {"header": {"frame_id": "/map"}, "pose": {"position": {"x": 0, "y": 0}}}
        message = {"status": self.status(1), "feedback": {"base_position": place}}
        event = of_topics("feedback", message)
        assert event == GoalProgress("r1", "g1", True, left=5.0)

    @pytest.mark.parametrize(
        "place",
        [
            {"header": {"frame_id": "odom"}, "pose": {"position": {"x": 0, "y": 0}}},
            {"header": {"frame_id": "map"}, "pose": {"position": {"x": None, "y": 0}}},
            {"header": {"frame_id": "map"}, "pose": {"position": {"x": 0, "y": None}}},
            None,
        ],
    )
    def test_move_base_feedback_without_a_valid_map_position_gives_no_distance(
        self, place
    ):
        feedback = {"base_position": place} if place else None
        message = {"status": self.status(1), "feedback": feedback}
        assert of_topics("feedback", message) == GoalProgress("r1", "g1", True)

    def test_unrelated_messages_are_ignored(self):
        other = self.status(1, id="g0")
        assert of_topics("status", {"status_list": [other]}) is None
        assert of_topics("status", {"status_list": [self.status(77)]}) is None
        assert of_topics("result", {"status": other}) is None
        assert of_topics("result", {}) is None
        assert of_topics("goal", {"status": self.status(1)}) is None
        assert of_topics("status", "text") is None
        assert of_topics("status", {}, op="status") is None
        assert of_topics("status", {}, op=7) is None
