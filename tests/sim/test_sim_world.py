import math

import pytest
from simulated import room

from webmap.base.errors import ConfigError
from webmap.base.geometry import Pose, Twist
from webmap.sim.maps import FLOOR, load_map
from webmap.sim.navigator import GoalState, SimGoal
from webmap.sim.world import World, WorldOptions


@pytest.fixture(scope="module")
def floor():
    return load_map(FLOOR)


def forward(world, seconds, until=lambda: False):
    """Let time pass; return how much passed."""
    start = world.now
    while world.now - start < seconds and not until():
        world.step(0.025)
    return world.now - start


def place(world, *poses):
    for robot, pose in zip(world.robots, poses, strict=True):
        robot.pose = robot.odometry = pose


def test_the_same_seed_gives_the_same_start_poses(floor):
    first = [r.pose for r in World(floor, WorldOptions(robots=5, seed=3)).robots]
    again = [r.pose for r in World(floor, WorldOptions(robots=5, seed=3)).robots]
    other = [r.pose for r in World(floor, WorldOptions(robots=5, seed=4)).robots]
    assert first == again
    assert first != other


def test_robots_start_apart_from_each_other_in_free_space(floor):
    world = World(floor, WorldOptions(robots=30))
    poses = [robot.pose for robot in world.robots]
    for i, a in enumerate(poses):
        assert not world.obstacles.touches(a.x, a.y, 0.5)
        for b in poses[:i]:
            assert math.hypot(a.x - b.x, a.y - b.y) > 1.0


def test_a_map_without_enough_free_space_is_refused():
    with pytest.raises(ConfigError, match="room for"):
        World(room(2.5, 2.5), WorldOptions(robots=40))
    with pytest.raises(ConfigError, match="no free place"):
        World(room(0.5, 0.5), WorldOptions(robots=1))


def test_a_robot_stops_at_the_wall():
    world = World(room(10, 6), WorldOptions(robots=1))
    place(world, Pose(5, 3, 0.0))
    for _ in range(400):
        world.command(0, Twist(vx=1.0))
        world.step(0.025)
    # The wall's face is at 9.95 m, the base's radius 0.25 m.
    assert world.robots[0].pose.x == pytest.approx(9.70, abs=0.03)
    assert world.robots[0].pose.x <= 9.70


def test_two_robots_stop_before_they_collide():
    world = World(room(10, 6), WorldOptions(robots=2))
    place(world, Pose(3, 3, 0.0), Pose(6, 3, math.pi))
    for _ in range(400):
        world.command(0, Twist(vx=1.0))
        world.command(1, Twist(vx=1.0))
        world.step(0.025)
    a, b = (robot.pose for robot in world.robots)
    assert 0.5 <= b.x - a.x < 0.56


def test_scans_show_the_other_robots():
    world = World(room(10, 6), WorldOptions(robots=2))
    place(world, Pose(3, 3, 0.0), Pose(6, 3, math.pi))
    first, second = world.sweep([0, 1])
    assert first[180] == pytest.approx(2.75)
    assert second[180] == pytest.approx(2.75)


def test_a_robot_reaches_a_goal_behind_a_wall():
    plan = room(10, 6, boxes=[(5.0, 0.0, 5.2, 4.5)])
    world = World(plan, WorldOptions(robots=1))
    place(world, Pose(2, 2, 0.0))
    goal = SimGoal(Pose(8, 2, 1.0))
    world.send_goal(0, goal)
    forward(world, 60, lambda: goal.state is not GoalState.ACTIVE)
    assert goal.state is GoalState.SUCCEEDED
    pose = world.robots[0].pose
    assert math.hypot(pose.x - 8, pose.y - 2) < 0.15
    assert pose.yaw == pytest.approx(1.0, abs=0.1)


def test_every_room_of_the_floor_can_be_reached(floor):
    world = World(floor, WorldOptions(robots=1))
    rooms = [(-18, 3), (-10, 3), (-13, 7.7), (-2, 3), (5, 3.2), (-3, 7.3), (13, 10)]
    rooms += [(-18, -3), (-8.3, -3), (-3, -4), (3, -5.5), (11, -7), (17, -6.4), (16, 0)]
    pose = world.robots[0].pose
    reachable = world.planner.reachable(pose.x, pose.y)
    assert all(reachable[world.planner.cell(x, y)] for x, y in rooms)


def test_a_goal_in_a_wall_is_aborted():
    world = World(room(10, 6), WorldOptions(robots=1))
    goal = SimGoal(Pose(0.1, 0.1))
    world.send_goal(0, goal)
    forward(world, 2, lambda: goal.state is not GoalState.ACTIVE)
    assert goal.state is GoalState.ABORTED
    assert world.robots[0].twist.is_zero


def test_cancelling_a_goal_stops_the_robot():
    world = World(room(10, 6), WorldOptions(robots=1))
    place(world, Pose(2, 3, 0.0))
    goal = SimGoal(Pose(8, 3))
    world.send_goal(0, goal)
    forward(world, 3)
    assert world.robots[0].twist.vx > 0.3
    world.navigators[0].cancel("enough")
    forward(world, 1)
    assert goal.state is GoalState.CANCELED
    assert world.robots[0].twist.is_zero


def test_a_new_goal_cancels_the_previous_goal():
    world = World(room(10, 6), WorldOptions(robots=1))
    first, second = SimGoal(Pose(8, 3)), SimGoal(Pose(2, 3))
    world.send_goal(0, first)
    forward(world, 1)
    world.send_goal(0, second)
    assert first.state is GoalState.CANCELED
    forward(world, 60, lambda: second.state is not GoalState.ACTIVE)
    assert second.state is GoalState.SUCCEEDED


def test_a_velocity_from_a_client_cancels_the_goal():
    world = World(room(10, 6), WorldOptions(robots=1))
    goal = SimGoal(Pose(8, 3))
    world.send_goal(0, goal)
    forward(world, 1)
    world.command(0, Twist(vx=0.2))
    assert goal.state is GoalState.CANCELED


def test_a_zero_velocity_pauses_a_robot_without_cancelling_its_goal():
    world = World(room(10, 6), WorldOptions(robots=1))
    place(world, Pose(2, 3, 0.0))
    goal = SimGoal(Pose(8, 3))
    world.send_goal(0, goal)
    forward(world, 2)
    for _ in range(40):
        world.command(0, Twist())
        world.step(0.025)
    assert world.robots[0].twist.is_zero
    forward(world, 60, lambda: goal.state is not GoalState.ACTIVE)
    assert goal.state is GoalState.SUCCEEDED


def test_a_robot_reaches_its_goal_around_another_robot():
    world = World(room(10, 6), WorldOptions(robots=2))
    place(world, Pose(2, 3, 0.0), Pose(4, 3, 0.0))
    goal = SimGoal(Pose(8, 3))
    world.send_goal(0, goal)
    forward(world, 60, lambda: goal.state is not GoalState.ACTIVE)
    assert goal.state is GoalState.SUCCEEDED
    assert world.robots[1].pose == Pose(4, 3, 0.0)


def test_robots_wander_only_with_the_wander_option(floor):
    still = World(floor, WorldOptions(robots=2))
    before = [robot.pose for robot in still.robots]
    forward(still, 10)
    assert [robot.pose for robot in still.robots] == before
    busy = World(floor, WorldOptions(robots=2, wander=True))
    forward(busy, 20)
    assert all(robot.travelled > 1 for robot in busy.robots)


def test_a_velocity_from_a_client_ends_the_goal_of_a_wandering_robot(floor):
    world = World(floor, WorldOptions(robots=1, wander=True))
    forward(world, 5)
    assert world.navigators[0].goal is not None
    for _ in range(40):
        world.command(0, Twist(wz=0.5))
        world.step(0.025)
    assert world.navigators[0].goal is None
    assert world.robots[0].twist == Twist(wz=0.5)


def test_a_long_plan_is_computed_over_several_steps(floor):
    world = World(floor, WorldOptions(robots=1))
    place(world, Pose(-18, -3.0))
    goal = SimGoal(Pose(16, -6.6))
    world.send_goal(0, goal)
    steps = 0
    while not world.navigators[0].path:
        world.step(0.025)
        steps += 1
    assert steps > 3
