"""The tasks lane: goals, cancels, hooks, and the reports about them."""

import json

import pytest
from link_bench import in_loop, noting_bridge

from equipment.gate_harness import spec
from equipment.waiting import until
from webmap.config.motion import StopHook
from webmap.gate.actions import SendGoal, SendPose
from webmap.gate.events import GoalEnded, GoalLost, GoalProgress, Key, LinkDown, LinkUp
from webmap.gate.lanes import tasks
from webmap.gate.lanes.tasks import (
    ServiceCalls,
    TasksLane,
    goal_topics,
    hook_topics,
)

pytestmark = pytest.mark.slow

MOVE_BASE = spec(
    action="/move_base", action_type="move_base_msgs/MoveBaseAction", cancel_topic=None
)
NAVIGATES = spec(action="/go", cancel_topic=None, goal_topic=None)


def goal(id="g1", way="topic", robot="r1"):
    return SendGoal(Key("ws://x", "/cmd_vel"), robot, id, 1.0, 2.0, 0.0, "a", way)


class Noting:
    """A tasks lane and its events."""

    def __init__(self, url):
        self.events = []
        self.calls = ServiceCalls(url)
        self.tasks = TasksLane(url, self.events.append, self.calls)
        self.tasks.lane.hold("robots")

    async def __aenter__(self):
        await self.up()
        return self

    async def __aexit__(self, *_):
        self.tasks.close()
        self.calls.close()
        await self.calls.settle()

    def of(self, type):
        return [event for event in self.events if isinstance(event, type)]

    async def up(self, times=1):
        await until(lambda: len(self.of(LinkUp)) == times, "the link")

    async def send(self, robot, id):
        """Send an action goal, and wait for the next link of the lane."""
        count = len(self.of(LinkUp))
        assert self.tasks.send(robot, goal(id, "navigate_to_pose", robot.id))
        await self.up(count + 1)


def action_message(op, id, **more):
    return json.dumps({"op": op, "id": id, **more})


class TestTopics:
    def test_goal_topics_are_only_the_topics_that_the_robot_uses(self):
        assert goal_topics(spec(goal_topic=None, cancel_topic=None)) == []
        pose = spec(pose_topic="/initialpose")
        assert [name for name, _ in goal_topics(pose)] == [
            "/goal",
            "/cancel",
            "/initialpose",
        ]
        assert goal_topics(NAVIGATES) == []
        assert [name for name, _ in goal_topics(MOVE_BASE)] == [
            "/goal",
            "/move_base/goal",
            "/move_base/cancel",
        ]

    def test_a_goal_topic_that_is_used_twice_is_listed_once(self):
        robot = spec(
            goal_topic=None,
            cancel_topic="/move_base/cancel",
            action="/move_base",
            action_type="move_base_msgs/MoveBaseAction",
        )
        names = [name for name, _ in goal_topics(robot)]
        assert sorted(names) == ["/move_base/cancel", "/move_base/goal"]

    def test_only_topic_hooks_have_a_hook_topic(self):
        robot = spec(
            stop_hooks=(
                StopHook(service="/e_stop", type="std_srvs/Trigger"),
                StopHook(topic="/lock", type="std_msgs/Bool"),
            )
        )
        assert hook_topics(robot) == [("/lock", "std_msgs/Bool")]


class TestTopicGoals:
    @in_loop
    async def test_topics_are_advertised_and_unadvertised(self):
        async with noting_bridge() as bridge, Noting(bridge.url) as noting:
            noting.tasks.attach(goal_topics(spec()))
            await until(lambda: len(bridge.of("advertise")) == 2, "both topics")
            noting.tasks.detach(goal_topics(spec()))
            await until(lambda: len(bridge.of("unadvertise")) == 2, "the end of both")

    @in_loop
    async def test_a_goal_without_a_link_is_never_sent(self):
        async with noting_bridge() as bridge, Noting(bridge.url) as noting:
            assert noting.tasks.send(spec(), goal("g1"))
            await until(lambda: bridge.of("publish", "/goal"), "the goal")
            noting.tasks.lane.cut("no longer used")
            assert noting.events[-1] == LinkDown(bridge.url, "tasks")
            assert not noting.tasks.send(spec(), goal("g2"))
            await noting.up(2)
            located = spec(pose_topic="/initialpose")
            at = SendPose(Key("ws://x", "/cmd_vel"), "r1", 1.0, 2.0, 0.0, "a")
            assert noting.tasks.send_pose(located, at)
            await until(lambda: bridge.of("publish", "/initialpose"), "the pose")
            assert len(bridge.of("publish", "/goal")) == 1

    @in_loop
    async def test_goals_are_cancelled_by_every_topic_and_service_of_the_robot(self):
        async with noting_bridge() as bridge, Noting(bridge.url) as noting:
            noting.tasks.cancel(spec(cancel_topic=None))  # no cancel topic
            noting.tasks.cancel(spec(cancel_topic="/stop_it", action="/go"))
            await noting.calls.settle()
            noting.tasks.cancel(
                spec(
                    cancel_topic="/move_base/cancel",
                    action="/move_base",
                    action_type="move_base_msgs/MoveBaseAction",
                )
            )
            noting.tasks.cancel(MOVE_BASE)
            await until(lambda: len(bridge.of("publish")) == 3, "all cancels")
            assert [t.topic for t in bridge.of("publish")] == [
                "/stop_it",
                "/move_base/cancel",
                "/move_base/cancel",
            ]
            (call,) = bridge.of("call_service")
            assert call.message["service"] == "/go/_action/cancel_goal"
            assert call.link != bridge.of("publish")[0].link

    @in_loop
    async def test_topic_hooks_publish_flags_and_service_hooks_call_services(self):
        async with noting_bridge() as bridge, Noting(bridge.url) as noting:
            flag = StopHook(topic="/lock", type="std_msgs/Bool")
            ended = []
            noting.tasks.run_hook(flag, True, ended.append)
            noting.tasks.run_hook(flag, False, ended.append)
            trigger = StopHook(service="/e_stop", type="std_srvs/Trigger")
            noting.tasks.run_hook(trigger, True, ended.append)
            await noting.calls.settle()
            await until(lambda: len(bridge.of("publish", "/lock")) == 2, "both flags")
            flags = [t.message["msg"]["data"] for t in bridge.of("publish", "/lock")]
            assert flags == [True, False]
            assert ended == [None] * 3
            assert bridge.of("call_service")[0].message["service"] == "/e_stop"


class TestActionGoals:
    @in_loop
    async def test_a_goal_that_blocks_its_socket_does_not_delay_other_goals_or_cancels(
        self,
    ):
        async with noting_bridge() as bridge, Noting(bridge.url) as noting:
            bridge.goals_block = True
            await noting.send(NAVIGATES, "g1")
            await noting.send(NAVIGATES, "g2")
            noting.tasks.cancel(NAVIGATES)
            await noting.calls.settle()
            await until(lambda: bridge.of("call_service"), "the cancel")
            await until(lambda: len(bridge.of("send_action_goal")) == 2, "both")
            assert len({t.link for t in bridge.received}) == 3
            assert noting.of(GoalLost) == [], "a socket that was spent is not lost"
            assert all(down.spent for down in noting.of(LinkDown))
            bridge.unblock()

    @in_loop
    async def test_feedback_is_reported_until_the_result_closes_the_goal_socket(
        self, monkeypatch
    ):
        monkeypatch.setattr(tasks, "FEEDBACK_PERIOD", 60.0)
        async with noting_bridge() as bridge, Noting(bridge.url) as noting:
            await noting.send(NAVIGATES, "g1")
            (sent,) = await until(lambda: bridge.of("send_action_goal"), "the goal")
            for distance in (2.0, 1.9, 1.8):
                values = {"distance_remaining": distance}
                message = action_message("action_feedback", "g1", values=values)
                await bridge.send(sent.link, message)
            await bridge.send(sent.link, "rubbish")
            await bridge.send(sent.link, action_message("action_result", "g0"))
            result = action_message("action_result", "g1", status=4, values={})
            await bridge.send(sent.link, result)
            await until(lambda: noting.of(GoalEnded), "its end")
            assert noting.of(GoalEnded) == [GoalEnded("r1", "g1", "reached")]
            received = [event.left for event in noting.of(GoalProgress)]
            assert received == [2.0], "only one report in each period"
            await until(lambda: sent.link not in bridge.links, "the end of its socket")
            assert noting.of(GoalLost) == []

    @in_loop
    async def test_feedback_is_reported_again_after_the_feedback_period(
        self, monkeypatch
    ):
        monkeypatch.setattr(tasks, "FEEDBACK_PERIOD", 0.0)
        async with noting_bridge() as bridge, Noting(bridge.url) as noting:
            await noting.send(NAVIGATES, "g1")
            (sent,) = await until(lambda: bridge.of("send_action_goal"), "the goal")
            for distance in (2.0, 1.0):
                values = {"distance_remaining": distance}
                message = action_message("action_feedback", "g1", values=values)
                await bridge.send(sent.link, message)
            await until(lambda: len(noting.of(GoalProgress)) == 2, "both reports")

    @in_loop
    async def test_a_goal_whose_socket_breaks_is_reported_as_lost(self):
        async with noting_bridge() as bridge, Noting(bridge.url) as noting:
            await noting.send(NAVIGATES, "g1")
            (sent,) = await until(lambda: bridge.of("send_action_goal"), "the goal")
            bridge.transport_of(sent.link).abort()
            (lost,) = await until(lambda: noting.of(GoalLost), "the report")
            assert (lost.robot, lost.id) == ("r1", "g1")
            assert lost.why.startswith("connection lost: ")

    @in_loop
    async def test_the_oldest_of_too_many_goals_is_reported_as_lost(self, monkeypatch):
        monkeypatch.setattr(tasks, "MAX_SPENT", 2)
        async with noting_bridge() as bridge, Noting(bridge.url) as noting:
            for number in range(3):
                robot = spec(id=f"r{number}", action="/go")
                await noting.send(robot, f"g{number}")
            (lost,) = noting.of(GoalLost)
            assert (lost.robot, lost.id) == ("r0", "g0")
            assert lost.why == f"more than 2 goals are under way at {bridge.url}"
            await until(lambda: len(bridge.of("send_action_goal")) == 3, "all goals")
            first = bridge.of("send_action_goal")[0].link
            await until(lambda: first not in bridge.links, "the end of its socket")

    @in_loop
    async def test_closing_the_lane_closes_its_goal_sockets_but_not_a_running_call(
        self,
    ):
        async with noting_bridge() as bridge:
            bridge.answers_services = False
            async with Noting(bridge.url) as noting:
                await noting.send(NAVIGATES, "g1")
                noting.tasks.cancel(NAVIGATES)
                (call,) = await until(lambda: bridge.of("call_service"), "the cancel")
                await until(lambda: len(bridge.links) == 3, "three sockets")
                noting.tasks.close()
                await until(lambda: bridge.links == {call.link}, "the end of the rest")
            bridge.unblock()
            await until(lambda: not bridge.links, "the end of all sockets")
            assert noting.of(GoalLost) == []


class TestMoveBase:
    def message(self, part, id="g1", status=1):
        state = {"goal_id": {"id": id}, "status": status, "text": "aborted"}
        msg = {"status_list": [state]} if part == "status" else {"status": state}
        operation = {"op": "publish", "topic": f"/move_base/{part}", "msg": msg}
        return json.dumps(operation)

    @in_loop
    async def test_move_base_topics_are_subscribed_from_before_the_goal_until_its_end(
        self,
    ):
        async with noting_bridge() as bridge, Noting(bridge.url) as noting:
            assert noting.tasks.send(MOVE_BASE, goal("g1", "move_base"))
            await until(lambda: bridge.of("publish", "/move_base/goal"), "the goal")
            assert [t.op for t in bridge.received] == ["subscribe"] * 3 + ["publish"]
            await bridge.send(1, "rubbish")
            await bridge.send(1, self.message("status"))
            await until(lambda: noting.of(GoalProgress), "progress")
            await bridge.send(1, self.message("result", status=4))
            await until(lambda: noting.of(GoalEnded), "its end")
            assert noting.of(GoalEnded) == [GoalEnded("r1", "g1", "failed", "aborted")]
            await until(
                lambda: len(bridge.of("unsubscribe")) == 3,
                "the end of the subscriptions",
            )
            noting.tasks.forget("r1")  # there is nothing to forget

    @in_loop
    async def test_a_move_base_goal_without_a_link_is_neither_sent_nor_followed(self):
        async with noting_bridge() as bridge, Noting(bridge.url) as noting:
            noting.tasks.lane.cut("no longer used")
            assert not noting.tasks.send(MOVE_BASE, goal("g1", "move_base"))
            await noting.up(2)
            assert bridge.received == []
            assert noting.of(GoalLost) == []

    @in_loop
    async def test_a_move_base_goal_is_lost_with_the_link_and_found_on_the_next_link(
        self,
    ):
        async with noting_bridge() as bridge, Noting(bridge.url) as noting:
            noting.tasks.send(MOVE_BASE, goal("g1", "move_base"))
            await until(lambda: bridge.of("publish"), "the goal")
            bridge.transport_of(1).abort()
            why = f"no connection to {bridge.url}"
            await until(lambda: noting.of(GoalLost), "the report")
            assert noting.of(GoalLost) == [GoalLost("r1", "g1", why)]
            await until(lambda: len(bridge.of("subscribe")) == 6, "new subscriptions")
            await bridge.send(2, self.message("status"))
            await until(lambda: noting.of(GoalProgress), "progress")

    @in_loop
    async def test_a_move_base_goal_is_not_lost_when_another_robot_gets_an_action_goal(
        self,
    ):
        async with noting_bridge() as bridge, Noting(bridge.url) as noting:
            noting.tasks.send(MOVE_BASE, goal("g1", "move_base"))
            noting.tasks.send(NAVIGATES, goal("g2", "navigate_to_pose", "r2"))
            await noting.up(2)
            assert noting.of(GoalLost) == [], "the socket only has another use"
            await until(lambda: len(bridge.of("subscribe")) == 6, "new subscriptions")
