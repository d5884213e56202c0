"""Goals of NavigateToPose at a bridge of Foxglove."""

import json
import math
import struct

import pytest
from link_bench import in_loop
from test_gate_foxglove import Server, Tasks, data, response

from equipment.foxglove_actions import ABORTED, SUCCEEDED, Navigation, write
from equipment.gate_harness import spec
from equipment.waiting import until
from webmap.gate.actions import SendGoal
from webmap.gate.events import (
    ActionsOffered,
    GoalEnded,
    GoalLost,
    GoalProgress,
    Key,
    LinkUp,
)
from webmap.gate.lanes import foxglove, serialization, tasks

GO = "/navigate_to_pose"
ROBOT = spec(goal_topic=None, cancel_topic=None, action=GO, goal_frame="map")


def goal(id="g1", robot="r1"):
    key, yaw = Key("u", "t"), math.pi / 2
    return SendGoal(key, robot, id, 1.0, 2.0, yaw, "a", "navigate_to_pose")


async def offered(noting, *actions):
    event = ActionsOffered(noting.lane.lane.url, frozenset(actions))
    await until(lambda: event in noting.events, f"the offer of {actions}")


async def sent(noting, navigation, id="g1"):
    """Send a goal; return it as the navigation received it."""
    await offered(noting, GO)
    count, links = len(navigation.goals), len(noting.of(LinkUp))
    await until(lambda: noting.lane.send(ROBOT, goal(id)), "a link that is clear")
    await until(lambda: len(navigation.goals) > count, "the goal")
    await until(lambda: len(noting.of(LinkUp)) > links, "the next link")
    return navigation.goals[-1]


class TestNavigation:
    """At the server of foxglove_bridge 3."""

    @in_loop
    async def test_a_goal_is_accepted_followed_and_reached(self, monkeypatch):
        monkeypatch.setattr(tasks, "FEEDBACK_PERIOD", 0.0)
        with Navigation() as navigation, Tasks(navigation.url) as noting:
            navigation.offer()
            found = await sent(noting, navigation)
            pose = found.request.pose
            assert pose.header.frame_id == "map"
            assert (pose.pose.position.x, pose.pose.position.y) == (1.0, 2.0)
            assert pose.pose.orientation.w == pytest.approx(math.sqrt(0.5))
            assert found.request.behavior_tree == ""
            accepted = GoalProgress("r1", "g1", active=False)
            await until(lambda: accepted in noting.events, "that it is accepted")
            navigation.feedback(1.5, id=bytes(16))  # for the goal of another client

            def under_way():
                navigation.feedback(2.25)
                return len(noting.of(GoalProgress)) > 1

            await until(under_way, "the feedback")
            assert noting.of(GoalProgress)[1] == GoalProgress(
                "r1", "g1", active=True, left=2.2, time=3.5, eta=4.0, recoveries=2
            )
            found.end(SUCCEEDED)
            ends = await until(lambda: noting.of(GoalEnded), "the end")
            assert ends == [GoalEnded("r1", "g1", "reached")]
            assert noting.of(GoalLost) == []

    @pytest.mark.parametrize(
        ("version", "fields", "why"),
        [
            ("humble", {}, ""),
            ("jazzy", {"error_code": 9001}, "error 9001"),
            ("kilted", {"error_code": 1, "error_msg": "no path"}, "no path"),
        ],
    )
    @in_loop
    async def test_an_aborted_goal_has_the_reason_of_each_version_of_nav2(
        self, version, fields, why
    ):
        with (
            Navigation(version=version) as navigation,
            Tasks(navigation.url) as noting,
        ):
            navigation.offer()
            found = await sent(noting, navigation)
            found.end(ABORTED, **fields)
            (end,) = await until(lambda: noting.of(GoalEnded), "the end")
            assert end == GoalEnded("r1", "g1", "failed", why)

    @in_loop
    async def test_a_goal_is_cancelled(self):
        with Navigation() as navigation, Tasks(navigation.url) as noting:
            navigation.offer()
            await sent(noting, navigation)
            noting.lane.cancel(ROBOT)
            (end,) = await until(lambda: noting.of(GoalEnded), "the end")
            assert end.outcome == "cancelled"
            assert navigation.cancels == 1

    @in_loop
    async def test_a_goal_that_the_robot_rejects_has_failed(self):
        with Navigation() as navigation, Tasks(navigation.url) as noting:
            navigation.offer()
            navigation.rejects = True
            await offered(noting, GO)
            assert noting.lane.send(ROBOT, goal())
            (end,) = await until(lambda: noting.of(GoalEnded), "the end")
            why = "the robot rejected the goal"
            assert end == GoalEnded("r1", "g1", "failed", why)

    @in_loop
    async def test_a_goal_that_the_bridge_cannot_send_has_failed(self):
        with Navigation() as navigation, Tasks(navigation.url) as noting:
            navigation.offer()
            navigation.breaks = True
            await offered(noting, GO)
            assert noting.lane.send(ROBOT, goal())
            (end,) = await until(lambda: noting.of(GoalEnded), "the end")
            assert end.outcome == "failed"
            assert "could not send the goal" in end.why
            assert "out of order" in end.why

    @in_loop
    async def test_a_goal_whose_action_server_dies_is_lost(self):
        with Navigation() as navigation, Tasks(navigation.url) as noting:
            navigation.offer()
            await sent(noting, navigation)
            navigation.withdraw()
            (lost,) = await until(lambda: noting.of(GoalLost), "that it is lost")
            assert lost == GoalLost(
                "r1", "g1", "the bridge no longer offers the action"
            )
            await offered(noting)
            assert not noting.lane.send(ROBOT, goal("g2"))
            navigation.goals[-1].end(SUCCEEDED)  # nobody listens any more
            navigation.offer()
            await until(
                lambda: noting.of(ActionsOffered)[-1].actions == {GO}, "the next offer"
            )
            await sent(noting, navigation, "g3")
            assert noting.of(GoalEnded) == []

    @in_loop
    async def test_a_goal_whose_result_fails_is_lost(self):
        with Navigation() as navigation, Tasks(navigation.url) as noting:
            navigation.offer()
            found = await sent(noting, navigation)
            found.end(None)
            (lost,) = await until(lambda: noting.of(GoalLost), "that it is lost")
            assert "got no result" in lost.why
            assert "has died" in lost.why

    @in_loop
    async def test_a_goal_is_lost_with_its_bridge(self):
        with Navigation() as navigation, Tasks(navigation.url) as noting:
            navigation.offer()
            await sent(noting, navigation)
            navigation.__exit__()
            (lost,) = await until(lambda: noting.of(GoalLost), "the loss")
            assert (lost.robot, lost.id) == ("r1", "g1")

    @in_loop
    async def test_the_next_gate_does_not_take_over_a_goal_but_cancels_it(self):
        with Navigation() as navigation:
            with Tasks(navigation.url) as first:
                navigation.offer()
                old = await sent(first, navigation, "g1")
            with Tasks(navigation.url) as second:
                await sent(second, navigation, "g1")
                assert navigation.goals[-1].id != old.id
                navigation.feedback(1.5, id=old.id)
                old.end(ABORTED)
                second.lane.cancel(ROBOT)
                (end,) = await until(lambda: second.of(GoalEnded), "the end")
                assert end.outcome == "cancelled"
                assert not any(each.active for each in second.of(GoalProgress))

    @in_loop
    async def test_an_action_without_all_its_services_is_not_offered(self):
        with Navigation() as navigation, Tasks(navigation.url) as noting:
            navigation.offer("send_goal", "get_result")
            await noting.up()
            wire = noting.lane._wire
            await until(lambda: len(wire._services) == 2, "the services")
            assert noting.of(ActionsOffered) == []
            assert not noting.lane.send(ROBOT, goal())


SERVICES = [
    {"id": 1, "name": f"{GO}/_action/send_goal", "type": foxglove._ACTION["send_goal"]},
    {
        "id": 2,
        "name": f"{GO}/_action/get_result",
        "type": foxglove._ACTION["get_result"],
    },
    {
        "id": 3,
        "name": f"{GO}/_action/cancel_goal",
        "type": "action_msgs/srv/CancelGoal",
    },
]


class TestFrames:
    """At a bridge whose messages the test sends."""

    def offer(self, *services):
        return {"op": "advertiseServices", "services": services or SERVICES}

    @in_loop
    async def test_a_goal_without_a_feedback_topic_has_a_result(self):
        done = write("GetResult_Response_kilted", status=SUCCEEDED)
        async with Server() as server:
            with Tasks(server.url) as noting:
                await noting.up()
                await server.offer((7, f"{GO}/_action/feedback", "std_msgs/msg/Bool"))
                await server.offer((8, "/other", foxglove._FEEDBACK))
                await server.send(self.offer())
                await offered(noting, GO)
                assert noting.lane.send(ROBOT, goal())
                await until(lambda: server.published, "the goal")
                link = server.clients[0]
                await link.send(data(1, b""))  # a subscription that does not exist
                await link.send('{"op": "unadvertiseServices", "serviceIds": [3]}')
                await link.send(response(True, write("SendGoal_Response", accepted=1)))
                await until(lambda: len(server.published) == 2, "the call")
                assert server.of("subscribe") == []
                result = b"\3" + struct.pack("<III", 2, 2, 3) + b"cdr" + done
                await link.send(result)
                ends = await until(lambda: noting.of(GoalEnded), "the end")
                assert ends == [GoalEnded("r1", "g1", "reached")]

    @in_loop
    async def test_an_action_of_another_type_is_not_offered(self):
        spin = {**SERVICES[0], "type": "nav2_msgs/action/Spin_SendGoal"}
        async with Server() as server:
            with Tasks(server.url) as noting:
                await noting.up()
                await server.send(self.offer(spin, *SERVICES[1:]))
                await server.send(self.offer())
                await offered(noting, GO)
                assert len(noting.of(ActionsOffered)) == 1
                await server.send(self.offer(SERVICES[0]))
                withdrawn = {"op": "unadvertiseServices", "serviceIds": [1, 9]}
                await server.send(json.dumps(withdrawn))
                await offered(noting)

    @in_loop
    async def test_too_many_services_end_the_link(self, caplog, monkeypatch):
        monkeypatch.setattr(foxglove, "MOST_CHANNELS", 2)
        async with Server() as server:
            with Tasks(server.url) as noting:
                await noting.up()
                await server.send(self.offer())
                await until(lambda: "more than 2 services" in caplog.text, "the end")
                assert noting.of(ActionsOffered) == []


def test_a_feedback_that_is_too_short_is_refused():
    whole = write("FeedbackMessage", distance_remaining=1.0)
    id, fields = serialization.action_feedback(whole, 0)
    assert id == bytes(16)
    assert fields["distance_remaining"] == 1.0
    with pytest.raises(serialization.ProtocolError, match="too short"):
        serialization.action_feedback(whole[:-1], 0)
