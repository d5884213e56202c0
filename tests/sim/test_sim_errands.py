"""Errands: robots drive by themselves and pause for each command of a client."""

import math

import pytest
from simulated import Bench

from webmap.base.geometry import Pose
from webmap.sim.maps import FLOOR, load_map
from webmap.sim.navigator import QUIET, REST
from webmap.sim.world import LOW_CHARGE, World, WorldOptions

pytestmark = pytest.mark.slow

FREE, BUSY = 0, 1
PLAN = load_map(FLOOR)


def bench(dialect="ros1"):
    return Bench(dialect, "real", plan=PLAN, errands=1)


def under_way(dialect="ros1"):
    """A bench with a moving robot that has errands."""
    made = bench(dialect)
    made.run(1.5)
    until(made, 30, lambda: moves(made))
    return made


def until(made, seconds, condition):
    """Advance the time until the condition holds."""
    for _ in range(round(seconds / 0.5)):
        if condition():
            return
        made.run(0.5)
    assert condition(), f"not within {seconds} s"


def moves(made, index=BUSY):
    twist = made.world.robots[index].twist
    return abs(twist.vx) > 0.1


def where(made, index=BUSY):
    pose = made.world.robots[index].pose
    return pose.x, pose.y, pose.yaw


def goal_of(made, index=BUSY):
    return made.world.navigators[index].goal


def publish(topic, **message):
    return {"op": "publish", "topic": f"/robot_{BUSY}/{topic}", "msg": message}


def call(service, **args):
    return {"op": "call_service", "service": f"/robot_{BUSY}/{service}", "args": args}


def test_robots_with_errands_drive_from_place_to_place_and_the_others_wait():
    made = bench()
    start, places = where(made, FREE), set()
    for _ in range(400):
        made.run(0.5)
        if goal_of(made) is not None:
            places.add(goal_of(made).pose)
    assert len(places) > 2
    assert made.world.robots[BUSY].travelled > 10
    assert where(made, FREE) == start


def test_a_robot_rests_between_two_errands():
    made = under_way()
    until(made, 120, lambda: goal_of(made) is None)
    at = where(made)
    made.run(REST - 1)
    assert goal_of(made) is None
    assert math.dist(where(made)[:2], at[:2]) < 0.05
    made.run(2)
    assert goal_of(made) is not None


ZERO = {"linear": {"x": 0.0}, "angular": {"z": 0.0}}
COMMANDS = [
    ("ros1", publish("cmd_vel", linear={"x": 0.2})),
    ("ros1", publish("cmd_vel", **ZERO)),
    ("ros1", publish("cmd_vel", linear={"x": math.nan})),
    ("ros1", publish("move_base/cancel")),
    ("ros1", publish("move_base/cancel", id="a goal of somebody")),
    ("ros1", call("stop")),
    ("ros1", publish("errands/pause")),
    ("ros2", publish("cmd_vel", **ZERO)),
    ("ros2", call("navigate_to_pose/_action/cancel_goal")),
    ("ros2", call("stop")),
    ("ros2", publish("errands/pause")),
]


@pytest.mark.parametrize(("dialect", "command"), COMMANDS)
def test_a_command_ends_an_errand_and_the_next_begins_after_the_quiet_time(
    dialect, command
):
    made = under_way(dialect)
    made.client().send(**command)
    assert goal_of(made) is None, (
        "the goal ends with the command, not with the next step"
    )
    made.run(1)
    at = where(made)
    made.run(QUIET - 2)
    assert where(made) == at
    until(made, 30, lambda: moves(made))


@pytest.mark.parametrize(("dialect", "command"), COMMANDS)
def test_a_command_to_a_resting_robot_delays_the_next_errand(dialect, command):
    made = under_way(dialect)
    until(made, 120, lambda: goal_of(made) is None)
    made.client().send(**command)
    made.run(1)
    at = where(made)
    made.run(QUIET - 2)
    assert where(made) == at


@pytest.mark.parametrize("command", [publish("errands/pause"), publish("cmd_vel")])
def test_a_robot_does_not_continue_while_commands_come(command):
    made = under_way()
    client = made.client()
    client.send(**command)
    made.run(1)
    at = where(made)
    for _ in range(round(QUIET / 20) * 3):
        client.send(**command)
        made.run(20)
    assert where(made) == at


def test_after_the_goal_of_a_client_a_robot_waits_for_the_quiet_time():
    made = under_way()
    x, y, _ = where(made)
    pose = {"position": {"x": x, "y": y}, "orientation": {"w": 1.0}}
    stamped = {"header": {"frame_id": "map"}, "pose": pose}
    made.client().send(**publish("move_base_simple/goal", **stamped))
    assert goal_of(made).pose == Pose(x, y)
    until(made, 60, lambda: goal_of(made) is None)
    made.run(1)
    at = where(made)
    made.run(QUIET - 3)
    assert where(made) == at
    until(made, 30, lambda: moves(made))


def test_commands_to_a_robot_do_not_pause_another():
    made = under_way()
    errand = goal_of(made)
    free = {**publish("cmd_vel", **ZERO), "topic": f"/robot_{FREE}/cmd_vel"}
    made.client().send(**free)
    assert goal_of(made) is errand


def test_a_robot_without_errands_has_no_topic_to_pause_them():
    made = bench()
    assert f"/robot_{BUSY}/errands/pause" in made.graph.topics
    assert f"/robot_{FREE}/errands/pause" not in made.graph.topics


def test_errands_change_no_start_pose():
    bare = World(PLAN, WorldOptions(robots=5))
    busy = World(PLAN, WorldOptions(robots=5, errands=3, low_battery=True))
    assert [r.pose for r in busy.robots] == [r.pose for r in bare.robots]
    assert [r.charge for r in busy.robots[:-1]] == [r.charge for r in bare.robots[:-1]]
    assert busy.robots[-1].charge == LOW_CHARGE
