import math

import pytest
from simulated import alone, coast, drive

from webmap.base.geometry import Pose, Twist


def test_one_metre_per_second_for_one_second_drives_one_metre():
    robot = alone()
    now = drive(robot, Twist(vx=1.0), 1.0)
    drive(robot, Twist(), 1.0, now=now)
    assert robot.pose.x == pytest.approx(1.0)
    assert robot.twist.is_zero


def test_a_robot_turns_by_the_commanded_angle():
    robot = alone()
    now = drive(robot, Twist(wz=1.0), 1.0)
    drive(robot, Twist(), 1.0, now=now)
    assert robot.pose.yaw == pytest.approx(1.0, abs=0.03)
    assert (robot.pose.x, robot.pose.y) == (0, 0)


def test_driving_and_turning_makes_a_circle():
    robot = alone(acceleration=1e6, turn_acceleration=1e6)
    drive(robot, Twist(vx=1.0, wz=0.5), math.tau / 0.5 / 2, dt=0.01)
    # Half a circle of radius 2 m, except for the ramp of the first step.
    assert robot.pose.x == pytest.approx(0, abs=0.02)
    assert robot.pose.y == pytest.approx(4, abs=0.02)


def test_a_robot_never_exceeds_its_acceleration():
    robot = alone(acceleration=2.0)
    now, before = 0.0, 0.0
    for _ in range(40):
        now = drive(robot, Twist(vx=1.0), 0.025, now=now)
        assert robot.twist.vx - before <= 2.0 * 0.025 + 1e-9
        before = robot.twist.vx
    assert robot.twist.vx == 1.0


def test_a_robot_never_exceeds_its_maximum_speeds():
    robot = alone(v_max=0.5, w_max=1.0)
    drive(robot, Twist(vx=-9.0, wz=9.0), 2.0)
    assert robot.twist == Twist(vx=-0.5, wz=1.0)


def test_a_robot_stops_after_its_command_timeout():
    robot = alone(timeout=0.25)
    now = drive(robot, Twist(vx=1.0), 1.0)
    now = coast(robot, 0.2, now=now)
    assert robot.twist.vx == 1.0
    now = coast(robot, 0.6, now=now)
    assert robot.twist.is_zero


def test_a_robot_without_a_command_timeout_never_stops():
    robot = alone(timeout=None)
    now = drive(robot, Twist(vx=1.0), 1.0)
    coast(robot, 10.0, now=now)
    assert robot.twist.vx == 1.0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_non_finite_twist_is_refused_and_does_not_reset_the_command_timeout(bad):
    robot = alone()
    now = drive(robot, Twist(vx=1.0), 1.0)
    for _ in range(20):
        assert not robot.command(Twist(vx=bad), now)
        now = coast(robot, 0.05, now=now)
    assert robot.twist.is_zero


def test_a_robot_that_accepts_infinity_drives_at_its_maximum_speed():
    robot = alone(refuse_nan=False, v_max=1.2)
    drive(robot, Twist(vx=math.inf), 2.0)
    assert robot.twist.vx == 1.2


def test_a_robot_blocked_by_a_wall_can_turn_and_drive_away():
    robot = alone()

    def wall(x, y):
        return x > 2.0

    now = drive(robot, Twist(vx=1.0), 4.0, blocked=wall)
    assert 1.9 < robot.pose.x <= 2.0
    assert robot.bumped
    assert robot.twist.vx == 0
    now = drive(robot, Twist(wz=1.0), 1.0, now=now, blocked=wall)
    assert robot.pose.yaw > 0.8
    drive(robot, Twist(vx=-1.0), 1.0, now=now, blocked=wall)
    assert robot.pose.x < 1.9


def test_without_drift_odometry_equals_the_pose():
    robot = alone(Pose(1, 2, 0.5))
    drive(robot, Twist(vx=1.0, wz=0.3), 3.0)
    assert robot.odometry == robot.pose


def test_drift_grows_with_the_driven_distance():
    robot = alone(drift=0.05)
    drive(robot, Twist(vx=1.0), 1.0)
    near = math.dist((robot.pose.x, robot.pose.y), (robot.odometry.x, robot.odometry.y))
    drive(robot, Twist(vx=1.0), 60.0)
    far = math.dist((robot.pose.x, robot.pose.y), (robot.odometry.x, robot.odometry.y))
    assert 0 < near < 0.1
    assert far > near


def test_a_standing_robot_does_not_drift():
    robot = alone(drift=0.05)
    coast(robot, 60.0, now=0.0)
    assert robot.odometry == robot.pose


def test_driving_drains_the_battery_faster_than_standing():
    idle, busy = alone(), alone()
    full = idle.charge
    coast(idle, 60, now=0.0)
    drive(busy, Twist(vx=1.0), 60)
    assert busy.charge < idle.charge < full


def test_the_planner_drives_only_while_no_client_does():
    robot = alone()
    robot.autonomous = Twist(vx=0.5)
    now = coast(robot, 1.0, now=0.0)
    assert robot.twist.vx == 0.5
    now = drive(robot, Twist(), 1.0, now=now)
    assert robot.twist.vx == 0
    coast(robot, 1.0, now=now)
    assert robot.twist.vx == 0.5
