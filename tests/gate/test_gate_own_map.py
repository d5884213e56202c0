"""Goals on the common map are sent to a robot in its own map."""

import math
import time

import pytest
from gate_page import Page
from hypothesis import given
from hypothesis import strategies as st

from equipment.declarations import changed, declared
from equipment.waiting import wait_for
from webmap.base.errors import ConfigError
from webmap.base.geometry import Pose
from webmap.gate.actions import SendGoal, SendPose
from webmap.gate.events import Key
from webmap.gate.lanes.tasks import in_own_map
from webmap.gate.protocol import RobotSpec
from webmap.gate.specs import checked

QUARTER = math.pi / 2
KEY = Key("ws://robot:9090", "/cmd_vel")
LENGTH = st.floats(-1000, 1000)
ANGLE = st.floats(-3.1, 3.1)


def robot(**changes) -> RobotSpec:
    return declared(goal_topic="/goal", **changes)


def goal(x, y, yaw) -> SendGoal:
    return SendGoal(KEY, "r1", "g1", x, y, yaw, "c1", "topic")


def test_a_goal_of_a_robot_on_the_common_map_is_not_changed():
    at = goal(1.0, 2.0, 0.5)
    assert in_own_map(robot(), at) is at


@given(LENGTH, LENGTH, ANGLE, LENGTH, LENGTH, ANGLE)
def test_a_goal_converted_to_the_own_map_converts_back_to_the_common_map(
    x, y, a, gx, gy, yaw
):
    received = in_own_map(robot(own_map=(x, y, a)), goal(gx, gy, yaw))
    back = Pose(x, y, a) @ Pose(received.x, received.y, received.yaw)
    assert (back.x, back.y) == pytest.approx((gx, gy), abs=1e-6)
    assert math.cos(back.yaw - yaw) == pytest.approx(1.0)


def test_a_set_pose_is_converted_to_the_own_map_of_the_robot():
    at = SendPose(KEY, "r1", 10.0, 3.0, QUARTER, "c1")
    received = in_own_map(robot(own_map=(10.0, 0.0, QUARTER)), at)
    assert (received.x, received.y, received.yaw) == pytest.approx((3.0, 0.0, 0.0))


def test_an_own_map_with_a_nan_position_raises_config_error():
    with pytest.raises(ConfigError, match="its own map lies on the common one"):
        checked(robot(own_map=(0.0, math.nan, 0.0)))


def test_a_goal_from_a_page_arrives_in_the_own_map_of_the_robot(
    client, fake, robot_spec
):
    aligned = changed(
        robot_spec, own_map=(10.0, 0.0, QUARTER), pose_topic="/initialpose"
    )
    client.declare(aligned)
    page = Page(client)
    page.take()

    def received(topic, op):
        if not fake.of("publish", topic):
            page.goal(op=op)  # at 1, 2 on the common map, facing along its x
            time.sleep(0.05)
        return fake.of("publish", topic)

    for topic, op in (("/initialpose", "locate"), ("/goal", "goal")):
        message = wait_for(lambda t=topic, o=op: received(t, o), f"the {op}")[0].message
        pose = message["msg"]["pose"]
        pose = pose.get("pose", pose)
        place, turn = pose["position"], pose["orientation"]
        assert (place["x"], place["y"]) == pytest.approx((2.0, 9.0))
        yaw = 2 * math.atan2(turn["z"], turn["w"])
        assert yaw == pytest.approx(-QUARTER)
    wait_for(lambda: page.robot().get("goal"), "the report")
    shown = page.robot()["goal"]
    assert (shown["x"], shown["y"], shown["yaw"]) == (1.0, 2.0, 0.0), "the common map"
    page.end()
