"""The lanes that robots need to their bridges, and the actions over the lanes."""

from link_bench import in_loop, noting_bridge

from equipment.declarations import changed
from equipment.gate_harness import spec
from equipment.waiting import until
from webmap.base.geometry import Twist
from webmap.config.motion import ScanAssistConfig, StopHook
from webmap.gate import actions
from webmap.gate.clock import now
from webmap.gate.events import (
    EchoReceived,
    Key,
    LinkDown,
    LinkUp,
    OdometryReceived,
    TwistWritten,
)
from webmap.gate.lanes.links import Links

SLOW, ZERO = Twist(0.1), Twist()
MOVING = {"twist": {"twist": {"linear": {"x": 0.5, "y": 0.0}, "angular": {"z": 0.0}}}}


class Noting:
    """All links of a gate, and their events."""

    def __init__(self):
        self.events = []
        self.links = Links(self.events.append)

    async def __aenter__(self):
        return self

    async def __aexit__(self, *_):
        self.links.close()
        await self.links.settle()

    def of(self, type):
        return [event for event in self.events if isinstance(event, type)]

    def do(self, action):
        return self.links.perform(action)

    def attach(self, robot):
        key = Key(robot.bridge_url, robot.base.topic)
        assert self.do(actions.Attach(key, robot)) is None
        return key

    async def up(self, *lanes):
        def up():
            return sorted(event.lane for event in self.of(LinkUp)) == sorted(lanes)

        await until(up, f"the links {lanes}")


@in_loop
async def test_links_are_open_only_while_a_robot_needs_them():
    async with noting_bridge() as bridge, Noting() as noting:
        robot = spec(bridge_url=bridge.url, odometry_topic="/odom")
        key = noting.attach(robot)
        await noting.up("control", "odometry", "tasks")
        await until(lambda: len(bridge.links) == 3, "three sockets")
        blind = spec(bridge_url=bridge.url, id="r1")
        noting.attach(blind)
        await until(lambda: len(bridge.links) == 2, "the end of the witness")
        noting.attach(spec(bridge_url=bridge.url, twist_topic=None, id="r2"))
        noting.do(actions.Detach(key, "r1"))
        await until(lambda: len(bridge.links) == 1, "the end of the control lane")
        noting.links.zero_all()  # no robot is driven
        noting.do(actions.Detach(Key(bridge.url, ""), "r2"))
        await until(lambda: not bridge.links, "the end of the last link")


@in_loop
async def test_a_stamped_velocity_uses_the_frame_of_the_newest_robot():
    async with noting_bridge() as bridge, Noting() as noting:
        stamped = {"bridge_url": bridge.url, "twist_type": "geometry_msgs/TwistStamped"}
        key = noting.attach(spec(**stamped, base_frame="base_link"))
        noting.attach(spec(**stamped, id="r2", base_frame="bob/base_link"))
        await noting.up("control", "tasks")
        noting.do(actions.WriteTwist(key, ZERO, None, None))
        await until(lambda: bridge.of("publish", "/cmd_vel"), "the zero")
        [received] = bridge.of("publish", "/cmd_vel")
        assert received.message["msg"]["header"]["frame_id"] == "bob/base_link"


@in_loop
async def test_a_velocity_is_sent_at_once_or_reported_as_dropped():
    async with noting_bridge() as bridge, Noting() as noting:
        key = Key(bridge.url, "/cmd_vel")
        write = actions.WriteTwist(key, SLOW, 7, "a")
        assert noting.do(write) == TwistWritten(key, SLOW, 7, "a", False), (
            "no such robot"
        )
        noting.attach(spec(bridge_url=bridge.url))
        assert noting.do(write) == TwistWritten(key, SLOW, 7, "a", False), "no link yet"
        await noting.up("control", "tasks")
        assert noting.do(write) == TwistWritten(key, SLOW, 7, "a", True)
        await until(lambda: bridge.of("publish", "/cmd_vel"), "the velocity")


@in_loop
async def test_a_velocity_after_its_deadline_is_dropped_but_a_zero_is_sent():
    async with noting_bridge() as bridge, Noting() as noting:
        key = Key(bridge.url, "/cmd_vel")
        noting.attach(spec(bridge_url=bridge.url))
        await noting.up("control", "tasks")
        late = actions.WriteTwist(key, SLOW, 7, "a", now() - 0.001)
        assert noting.do(late) == TwistWritten(key, SLOW, 7, "a", False)
        zero = actions.WriteTwist(key, ZERO, 7, "a", now() - 0.001)
        assert noting.do(zero) == TwistWritten(key, ZERO, 7, "a", True)
        await until(lambda: bridge.of("publish", "/cmd_vel"), "the zero")
        [received] = bridge.of("publish", "/cmd_vel")
        assert received.message["msg"]["linear"]["x"] == 0.0


@in_loop
async def test_a_goal_after_its_deadline_is_dropped():
    async with noting_bridge() as bridge, Noting() as noting:
        key = noting.attach(spec(bridge_url=bridge.url, goal_topic="/goal"))
        await noting.up("control", "tasks")
        at = (key, "r1", "g1", 1.0, 2.0, 0.0, "a", "topic")
        late = noting.do(actions.SendGoal(*at, now() - 0.001))
        assert not late.done
        assert noting.do(actions.SendGoal(*at, now() + 10.0)).done
        await until(lambda: bridge.of("publish", "/goal"), "the goal in time")
        assert len(bridge.of("publish", "/goal")) == 1


@in_loop
async def test_odometry_and_goals_may_use_other_bridges_than_velocity():
    async with (
        noting_bridge() as a,
        noting_bridge() as b,
        noting_bridge() as c,
        Noting() as noting,
    ):
        robot = spec(
            bridge_url=a.url,
            odometry_topic="/odom",
            odometry_url=b.url,
            goal_url=c.url,
            stop_hooks=(StopHook(topic="/lock", type="std_msgs/Bool"),),
            assist=ScanAssistConfig(topic="/scan", footprint=((0.1, 0.1), (-0.1, 0.0))),
        )
        key = noting.attach(robot)
        await noting.up("control", "odometry", "odometry", "tasks", "tasks")
        noting.do(actions.Watch(key, True))
        await until(lambda: len(a.of("subscribe")) == 2, "echo and scan")
        assert {t.topic for t in a.of("subscribe")} == {"/cmd_vel", "/scan"}
        await until(lambda: b.of("subscribe", "/odom"), "odometry")
        await until(lambda: len(c.of("advertise")) == 2, "goals")
        assert [t.topic for t in a.of("advertise", "/lock")] == ["/lock"]
        noting.do(actions.RunHook(key, "r1", robot.base.stop_hooks[0], True, 1))
        await until(lambda: a.of("publish", "/lock"), "the hook")
        noting.do(actions.Watch(key, False))
        await until(lambda: a.of("unsubscribe", "/scan"), "the end of scans")
        await until(lambda: b.of("unsubscribe", "/odom"), "the end of odometry")
        noting.do(actions.Detach(key, "r1"))
        await until(lambda: not (a.links | b.links | c.links), "the end of all")


@in_loop
async def test_removing_one_robot_of_a_machine_keeps_the_other_robot_watched():
    async with noting_bridge() as bridge, Noting() as noting:
        first = spec(bridge_url=bridge.url, odometry_topic="/odom")
        second = spec(bridge_url=bridge.url, odometry_topic="/odom2", id="r2")
        key = noting.attach(first)
        noting.attach(second)
        noting.do(actions.Watch(key, True))
        noting.do(actions.Watch(key, True))  # the same as watching once
        await until(lambda: len(bridge.of("subscribe")) >= 3, "all subscriptions")
        noting.do(actions.Detach(key, "r1"))
        await until(lambda: bridge.of("unsubscribe", "/odom"), "the end of the first")
        noting.events.clear()
        await bridge.publish("/odom", MOVING)
        await bridge.publish("/odom2", MOVING)
        await bridge.publish("/cmd_vel", MOVING["twist"]["twist"])
        await until(lambda: noting.of(EchoReceived), "the velocity of the machine")
        await until(lambda: noting.of(OdometryReceived), "its odometry")
        seen = [(one.key, one.twist) for one in noting.of(OdometryReceived)]
        assert seen == [(key, Twist(0.5))], "odometry of the second only"
        noting.do(actions.Detach(key, "r2"))
        await until(lambda: not bridge.links, "the end of its links")


@in_loop
async def test_a_new_declaration_ends_only_the_subscriptions_of_a_changed_action():
    async with noting_bridge() as bridge, Noting() as noting:
        robot = spec(
            bridge_url=bridge.url,
            action="/move_base",
            action_type="move_base_msgs/MoveBaseAction",
        )
        key = noting.attach(robot)
        await noting.up("control", "tasks")
        noting.do(actions.Watch(key, True))
        sent = actions.SendGoal(key, "r1", "g1", 1.0, 2.0, 0.0, "a", "move_base")
        assert noting.do(sent).done
        await until(lambda: bridge.of("publish", "/move_base/goal"), "the goal")
        noting.attach(changed(robot, v_max=0.2))
        noting.attach(changed(robot, action="/other"))
        await until(lambda: bridge.of("unsubscribe", "/move_base/status"), "its end")
        assert len(bridge.of("unsubscribe", "/move_base/status")) == 1
        listening = len(bridge.of("subscribe", "/cmd_vel"))
        ended = len(bridge.of("unsubscribe", "/cmd_vel"))
        assert listening == ended + 1, "the lane subscribes to its echo"


@in_loop
async def test_goals_poses_and_cancels_are_sent_to_the_topics_of_the_robot():
    async with noting_bridge() as bridge, Noting() as noting:
        robot = spec(bridge_url=bridge.url, pose_topic="/initialpose")
        key = noting.attach(robot)
        await noting.up("control", "tasks")
        sent = actions.SendGoal(key, "r1", "g1", 1.0, 2.0, 0.0, "a", "topic")
        assert noting.do(sent).done
        assert noting.do(actions.SendPose(key, "r1", 1.0, 2.0, 0.5, "a")).done
        noting.do(actions.CancelGoals(key, "r1"))
        await until(lambda: bridge.of("publish", "/cancel"), "the cancel")
        assert [t.topic for t in bridge.of("publish")] == [
            "/goal",
            "/initialpose",
            "/cancel",
        ]


@in_loop
async def test_a_cancel_is_still_sent_when_the_goals_move_to_another_bridge():
    """By topic and by service; the goals move immediately after the cancel."""
    async with noting_bridge() as old, noting_bridge() as new, Noting() as noting:
        robot = spec(bridge_url=new.url, goal_url=old.url, action="/go")
        key = noting.attach(robot)
        await noting.up("control", "tasks")
        await until(lambda: len(old.of("advertise")) == 2, "the topics of goals")
        noting.do(actions.CancelGoals(key, "r1"))
        noting.attach(changed(robot, goal_url=new.url))
        await noting.links.settle()
        (call,) = old.of("call_service")
        assert call.message["service"] == "/go/_action/cancel_goal"
        await until(lambda: old.of("publish", "/cancel"), "the cancel")
        await until(lambda: not old.links, "the end of both links")


@in_loop
async def test_every_link_that_is_no_longer_needed_is_reported_as_down():
    async with noting_bridge() as bridge, Noting() as noting:
        key = noting.attach(spec(bridge_url=bridge.url, odometry_topic="/odom"))
        await noting.up("control", "odometry", "tasks")
        noting.do(actions.Detach(key, "r1"))
        lanes = ("control", "odometry", "tasks")
        assert noting.of(LinkDown) == [LinkDown(bridge.url, lane) for lane in lanes]


@in_loop
async def test_a_new_declaration_does_not_advertise_unchanged_topics_again():
    async with noting_bridge() as bridge, Noting() as noting:
        robot = spec(bridge_url=bridge.url)
        noting.attach(robot)
        await noting.up("control", "tasks")
        noting.attach(changed(robot, goal_topic="/other"))
        await until(lambda: bridge.of("unadvertise", "/goal"), "the end of the old one")
        assert {t.topic for t in bridge.of("unadvertise")} == {"/goal"}
        assert len(bridge.of("advertise", "/cmd_vel")) == 1


@in_loop
async def test_cut_link_cuts_and_reopens_an_existing_link_only(caplog):
    async with noting_bridge() as bridge, Noting() as noting:
        noting.do(actions.CutLink(bridge.url))
        assert noting.events == []
        noting.attach(spec(bridge_url=bridge.url))
        await noting.up("control", "tasks")
        noting.do(actions.CutLink(bridge.url))
        assert noting.events[-1] == LinkDown(bridge.url, "control")
        await noting.up("control", "control", "tasks")
        assert "the bridge answered no ping for 1 s; next attempt" in caplog.text


@in_loop
async def test_zero_all_sends_zero_only_to_watched_machines_with_a_velocity_topic():
    async with noting_bridge() as bridge, Noting() as noting:
        watched = noting.attach(spec(bridge_url=bridge.url))
        noting.attach(spec(bridge_url=bridge.url, twist_topic="/idle", id="r2"))
        async with noting_bridge() as other:
            still = noting.attach(
                spec(bridge_url=other.url, twist_topic=None, odometry_topic="/odom")
            )
            await noting.up("control", "tasks", "tasks", "odometry")
            noting.do(actions.Watch(watched, True))
            noting.do(actions.Watch(still, True))
            noting.links.zero_all()
            await until(lambda: bridge.of("publish"), "the zero")
            received = [
                (t.topic, t.message["msg"]["linear"]) for t in bridge.of("publish")
            ]
            assert received == [("/cmd_vel", {"x": 0.0, "y": 0.0, "z": 0.0})]
            assert other.of("publish") == []
            noting.do(actions.Detach(still, "r1"))


@in_loop
async def test_closing_the_links_closes_every_socket_without_a_link_down_event():
    async with noting_bridge() as bridge:
        async with Noting() as noting:
            noting.attach(spec(bridge_url=bridge.url, odometry_topic="/odom"))
            await noting.up("control", "odometry", "tasks")
            await until(lambda: len(bridge.links) == 3, "three sockets")
        await until(lambda: not bridge.links, "the end of all sockets")
        assert noting.of(LinkDown) == []


@in_loop
async def test_the_links_ignore_actions_for_other_parts():
    async with Noting() as noting:
        assert noting.do(actions.Unlock(Key("ws://x", "/cmd_vel"))) is None
        assert noting.events == []
