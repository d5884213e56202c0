"""The gate leaves a bridge that hangs if a client leaves with queued messages."""

import asyncio

import pytest
from link_bench import in_loop

from equipment.gate_harness import spec
from equipment.hanging_bridge import hanging_bridge
from equipment.waiting import until
from webmap.gate.actions import SendGoal
from webmap.gate.events import EchoReceived, Key, LinkUp
from webmap.gate.lanes.calls import ServiceCalls
from webmap.gate.lanes.control import ControlLane
from webmap.gate.lanes.odometry import OdometryLane
from webmap.gate.lanes.tasks import TasksLane

pytestmark = pytest.mark.slow

KEY = Key("ws://x", "/cmd_vel")
MOVE_BASE = spec(
    action="/move_base", action_type="move_base_msgs/MoveBaseAction", cancel_topic=None
)
TYPES = {
    "/cmd_vel": "geometry_msgs/Twist",
    "/odom": "nav_msgs/Odometry",
    "/scan": "sensor_msgs/LaserScan",
    "/move_base/status": "actionlib_msgs/GoalStatusArray",
    "/move_base/feedback": "move_base_msgs/MoveBaseActionFeedback",
    "/move_base/result": "move_base_msgs/MoveBaseActionResult",
}


async def of(events, type):
    await until(lambda: any(isinstance(event, type) for event in events))


async def control(url, events):
    lane = ControlLane(url, events.append)
    lane.attach("/cmd_vel", "geometry_msgs/Twist")
    lane.listen("/cmd_vel")
    await of(events, EchoReceived)
    return lane, lambda: lane.ignore("/cmd_vel")


async def witness(url, events):
    lane = OdometryLane(url, events.append)
    lane.watch("/odom", "nav_msgs/Odometry", KEY)
    lane.watch_scan("/scan", KEY)
    await of(events, LinkUp)
    await asyncio.sleep(0.2)

    def unwatch():
        lane.unwatch("/odom", KEY)
        lane.unwatch_scan("/scan", KEY)

    return lane, unwatch


async def tasks(url, events):
    lane = TasksLane(url, events.append, ServiceCalls(url))
    lane.lane.hold("robots")
    lane.attach([("/move_base/goal", "move_base_msgs/MoveBaseActionGoal")])
    await of(events, LinkUp)
    goal = SendGoal(KEY, MOVE_BASE.id, "g1", 1.0, 2.0, 0.0, "a", "move_base")
    assert lane.send(MOVE_BASE, goal)
    await asyncio.sleep(0.2)
    return lane, lambda: lane.forget(MOVE_BASE.id)


async def by_a_reset_of_ours(bridge, lane, unsubscribe):
    lane.lane.cut("a test")


async def by_a_reset_of_the_network(bridge, lane, unsubscribe):
    bridge.reset_all()


async def by_closing(bridge, lane, unsubscribe):
    lane.lane.close()


async def by_unsubscribing(bridge, lane, unsubscribe):
    unsubscribe()


@pytest.mark.parametrize("lane_of", [control, witness, tasks])
@pytest.mark.parametrize(
    "leave",
    [by_a_reset_of_ours, by_a_reset_of_the_network, by_closing, by_unsubscribing],
)
@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
@in_loop
async def test_the_bridge_accepts_clients_after_a_lane_disconnects_or_unsubscribes(
    lane_of, leave, dialect
):
    async with hanging_bridge(dialect, TYPES) as bridge:
        lane, unsubscribe = await lane_of(bridge.url, [])
        try:
            await leave(bridge, lane, unsubscribe)
            await asyncio.sleep(0.1)  # the bridge sees it
            assert await bridge.accepts_client()
        finally:
            lane.lane.close()
