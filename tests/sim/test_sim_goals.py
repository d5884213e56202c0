"""Goals in both dialects: by topic, by actionlib, by ROS 2's action."""

import base64
import math

import pytest
from simulated import Bench

from webmap.base.geometry import Pose

ACTION = "/robot_0/navigate_to_pose"
ACTION_TYPE = "nav2_msgs/action/NavigateToPose"
CANCEL = f"{ACTION}/_action/cancel_goal"
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6


def pose_stamped(x, y, frame="map"):
    position, turn = {"x": x, "y": y}, {"w": 1.0}
    pose = {"position": position, "orientation": turn}
    return {"header": {"frame_id": frame}, "pose": pose}


def bench(dialect, quirks="polite"):
    made = Bench(dialect, quirks)
    for robot, y in zip(made.world.robots, (1.5, 4.5), strict=True):
        robot.pose = robot.odometry = Pose(2.0, y)
    return made


def where(made, index=0):
    pose = made.world.robots[index].pose
    return pose.x, pose.y


class TestTopic:
    @pytest.mark.parametrize(
        ("dialect", "name"),
        [
            ("ros1", "move_base_simple/goal"),
            ("ros2", "move_base_simple/goal"),
            ("ros2", "goal_pose"),
        ],
    )
    def test_a_published_pose_drives_the_robot_to_the_goal(self, dialect, name):
        made = bench(dialect)
        client = made.client()
        client.send(op="publish", topic=f"/robot_0/{name}", msg=pose_stamped(7, 1.5))
        made.run(15)
        assert math.dist(where(made), (7, 1.5)) < 0.15
        assert where(made, 1) == (2.0, 4.5)

    def test_the_plan_is_published(self):
        made = bench("ros1")
        client = made.client()
        client.send(op="subscribe", topic="/robot_0/plan")
        goal = pose_stamped(7, 1.5)
        client.send(op="publish", topic="/robot_0/move_base_simple/goal", msg=goal)
        made.run(1)
        path = client.operations("publish", "/robot_0/plan")[0]["msg"]
        assert path["header"]["frame_id"] == "map"
        assert path["poses"][-1]["pose"]["position"]["x"] == 7
        made.run(15)
        assert client.operations("publish")[-1]["msg"]["poses"] == []

    def test_a_goal_in_the_odometry_frame_is_accepted(self):
        made = bench("ros1")
        made.world.robots[0].odometry = Pose(0, 0)
        goal = pose_stamped(3, 0, "robot_0/odom")
        made.client().send(
            op="publish", topic="/robot_0/move_base_simple/goal", msg=goal
        )
        made.run(15)
        assert math.dist(where(made), (5, 1.5)) < 0.15

    def test_a_goal_in_an_unknown_frame_or_with_nan_moves_no_robot(self):
        made = bench("ros1", "real")
        client = made.client()
        topic = "/robot_0/move_base_simple/goal"
        client.send(op="publish", topic=topic, msg=pose_stamped(7, 1.5, "moon"))
        client.send(op="publish", topic=topic, msg=pose_stamped(math.nan, 1.5))
        made.run(3)
        assert where(made) == (2.0, 1.5)


class TestActionlib:
    def send(self, client, x, y, identifier=""):
        client.send(
            op="publish",
            topic="/robot_0/move_base/goal",
            msg={
                "goal_id": {"id": identifier},
                "goal": {"target_pose": pose_stamped(x, y)},
            },
        )

    def cancel(self, client, identifier=""):
        msg = {"id": identifier}
        client.send(op="publish", topic="/robot_0/move_base/cancel", msg=msg)

    def results(self, client):
        return [
            (m["msg"]["status"]["goal_id"]["id"], m["msg"]["status"]["status"])
            for m in client.operations("publish", "/robot_0/move_base/result")
        ]

    def test_a_goal_is_reached_and_its_result_is_reported(self):
        made = bench("ros1")
        client = made.client()
        client.send(op="subscribe", topic="/robot_0/move_base/result")
        self.send(client, 7, 1.5, "g1")
        made.run(15)
        assert self.results(client) == [("g1", 3)]
        assert math.dist(where(made), (7, 1.5)) < 0.15

    def test_status_and_feedback_report_the_progress_of_a_goal(self):
        made = bench("ros1")
        client = made.client()
        for part in ("status", "feedback"):
            client.send(op="subscribe", topic=f"/robot_0/move_base/{part}")
        self.send(client, 7, 1.5, "g1")
        made.run(2)
        found = client.operations()
        status = [m for m in found if m["topic"].endswith("status")][-1]["msg"]
        assert [s["goal_id"]["id"] for s in status["status_list"]] == ["g1"]
        assert status["status_list"][0]["status"] == 1
        feedback = [m for m in found if m["topic"].endswith("feedback")][-1]["msg"]
        base = feedback["feedback"]["base_position"]["pose"]["position"]
        assert base["x"] > 2.0

    def test_a_goal_whose_id_is_still_in_the_status_is_ignored(self):
        made = bench("ros1")
        client = made.client()
        self.send(client, 7, 1.5, "g1")
        made.run(1)
        self.send(client, 2, 1.5, "g1")
        made.run(15)
        assert math.dist(where(made), (7, 1.5)) < 0.15

    @pytest.mark.parametrize("identifier", ["g1", ""])
    def test_any_client_may_cancel_a_goal_by_topic(self, identifier):
        made = bench("ros1")
        client, other = made.client(), made.client()
        client.send(op="subscribe", topic="/robot_0/move_base/result")
        self.send(client, 7, 1.5, "g1")
        made.run(2)
        self.cancel(other, identifier)
        assert self.results(client) == [("g1", 2)]
        made.run(1)
        assert made.world.robots[0].twist.is_zero

    def test_cancelling_another_goal_does_not_stop_the_robot(self):
        made = bench("ros1")
        client = made.client()
        self.send(client, 7, 1.5, "g1")
        self.cancel(client, "g2")
        made.run(2)
        assert made.world.robots[0].twist.vx > 0.2

    def test_a_cancel_without_an_id_stops_a_goal_of_the_simple_topic(self):
        made = bench("ros1")
        client = made.client()
        goal = pose_stamped(7, 1.5)
        client.send(op="publish", topic="/robot_0/move_base_simple/goal", msg=goal)
        made.run(2)
        self.cancel(client)
        made.run(1)
        assert made.world.robots[0].twist.is_zero

    def test_a_new_goal_preempts_the_previous_goal(self):
        made = bench("ros1")
        client = made.client()
        client.send(op="subscribe", topic="/robot_0/move_base/result")
        self.send(client, 7, 1.5, "g1")
        self.send(client, 3, 1.5, "g2")
        made.run(15)
        assert self.results(client) == [("g1", 2), ("g2", 3)]

    def test_a_goal_in_a_wall_is_aborted_and_in_an_unknown_frame_rejected(self):
        made = bench("ros1")
        client = made.client()
        client.send(op="subscribe", topic="/robot_0/move_base/result")
        self.send(client, 0.0, 0.0, "wall")
        made.run(1)
        target = pose_stamped(1, 1, "moon")
        client.send(
            op="publish",
            topic="/robot_0/move_base/goal",
            msg={"goal_id": {"id": "moon"}, "goal": {"target_pose": target}},
        )
        assert self.results(client) == [("wall", 4), ("moon", 5)]


class TestAction:
    def send(self, client, x, y, identifier="goal:1", **more):
        client.send(
            op="send_action_goal",
            id=identifier,
            action=ACTION,
            action_type=ACTION_TYPE,
            args={"pose": pose_stamped(x, y)},
            **more,
        )

    def test_a_goal_is_reached_and_its_result_is_reported(self):
        made = bench("ros2")
        client = made.client()
        self.send(client, 7, 1.5, feedback=True)
        made.run(15)
        found = client.operations()
        assert found[-1]["op"] == "action_result"
        assert found[-1]["status"] == SUCCEEDED
        assert found[-1]["id"] == "goal:1"
        feedback = [o["values"] for o in found if o["op"] == "action_feedback"]
        left = [values["distance_remaining"] for values in feedback]
        assert left[1] > left[-1] >= 0
        assert math.dist(where(made), (7, 1.5)) < 0.15

    def test_a_goal_without_a_feedback_request_gets_no_feedback(self):
        made = bench("ros2")
        client = made.client()
        self.send(client, 7, 1.5)
        made.run(3)
        assert client.operations() == []

    def test_the_sender_may_cancel_its_goal(self):
        made = bench("ros2")
        client = made.client()
        self.send(client, 7, 1.5)
        made.run(2)
        client.send(op="cancel_action_goal", action=ACTION, id="goal:1")
        assert client.operations("action_result")[0]["status"] == CANCELED

    def test_another_socket_cannot_cancel_a_goal_by_its_id(self):
        made = bench("ros2")
        client, other = made.client(), made.client()
        self.send(client, 7, 1.5)
        made.run(1)
        other.send(op="cancel_action_goal", action=ACTION, id="goal:1")
        made.run(1)
        assert client.operations() == []
        assert made.world.robots[0].twist.vx > 0.2

    def test_another_socket_may_cancel_a_goal_by_the_cancel_service(self):
        made = bench("ros2", "real")
        client, other = made.client(), made.client()
        self.send(client, 7, 1.5)
        made.run(2)
        values = other.call(CANCEL, {})["values"]
        assert values["return_code"] == 0
        (info,) = values["goals_canceling"]
        assert len(base64.b64decode(info["goal_id"]["uuid"])) == 16
        assert client.operations("action_result")[0]["status"] == CANCELED
        made.run(1)
        assert made.world.robots[0].twist.is_zero

    def test_the_cancel_service_stops_a_goal_sent_by_topic(self):
        made = bench("ros2")
        client = made.client()
        client.send(op="publish", topic="/robot_0/goal_pose", msg=pose_stamped(7, 1.5))
        made.run(2)
        assert client.call(CANCEL, {})["result"] is True
        made.run(1)
        assert made.world.robots[0].twist.is_zero

    def test_cancelling_an_unknown_goal_is_refused(self):
        made = bench("ros2")
        client = made.client()
        self.send(client, 7, 1.5)
        info = {"goal_id": {"uuid": list(range(16))}}
        values = client.call(CANCEL, {"goal_info": info})["values"]
        assert values["return_code"] == 2
        assert values["goals_canceling"] == []

    def test_a_real_server_blocks_the_sender_until_the_goal_ends(self):
        made = bench("ros2", "real")
        client = made.client()
        self.send(client, 7, 1.5)
        client.send(op="publish", topic="/robot_1/cmd_vel", msg={"linear": {"x": 0.5}})
        client.send(op="cancel_action_goal", action=ACTION, id="goal:1")
        made.run(2)
        assert made.world.robots[0].twist.vx > 0.2
        assert made.world.robots[1].twist.is_zero
        made.run(15)
        assert client.operations("action_result")[0]["status"] == SUCCEEDED

    def test_a_goal_continues_after_its_sender_disconnects(self):
        made = bench("ros2")
        client = made.client()
        self.send(client, 7, 1.5)
        client.session.close()
        made.run(15)
        assert math.dist(where(made), (7, 1.5)) < 0.15

    def test_an_unreachable_goal_and_an_unknown_action_get_an_error_result(self):
        made = bench("ros2")
        client = made.client()
        self.send(client, 0.0, 0.0, "wall")
        made.run(1)
        assert client.operations("action_result")[0]["status"] == ABORTED
        client.send(
            op="send_action_goal",
            id="x",
            action="/nobody",
            action_type=ACTION_TYPE,
            args={},
        )
        (result,) = client.operations("action_result")
        assert result["result"] is False
        assert isinstance(result["values"], str)
