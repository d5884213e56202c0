"""``webmap discover`` against the simulator, in both dialects."""

import subprocess
import sys
import tomllib

import pytest

pytestmark = pytest.mark.slow


def discover(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "webmap", "discover", *arguments],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )


def test_discover_finds_ros_1_robots_by_namespace(ros1):
    result = discover(ros1)
    assert result.returncode == 0, result.stderr
    assert "ROS 1, 2 robots" in result.stdout
    assert "robot_1 (in /robot_1)" in result.stdout


def test_discover_finds_a_ros_2_robot_without_namespace_and_its_velocity_type(ros2):
    result = discover(ros2)
    assert result.returncode == 0, result.stderr
    assert "robot (without a namespace)" in result.stdout
    assert "geometry_msgs/msg/TwistStamped" in result.stdout


def test_discover_writes_two_bridges_to_one_fleet_file(ros1, ros2):
    result = discover("--toml", ros1, ros2)
    data = tomllib.loads(result.stdout)
    assert len(data["bridges"]) == 2
    assert len(data["robots"]) == 3


def test_discover_waits_for_an_unreachable_bridge_and_then_fails():
    result = discover("ws://127.0.0.1:1", "--wait", "2")
    assert result.returncode == 1
    assert result.stdout == ""
    assert "Waiting for the bridge at ws://127.0.0.1:1" in result.stderr
    assert "cannot reach" in result.stderr
    assert "Traceback" not in result.stderr
