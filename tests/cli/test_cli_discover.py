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
    said = discover(ros1)
    assert said.returncode == 0, said.stderr
    assert "ROS 1, 2 robots" in said.stdout
    assert "robot_1 (in /robot_1)" in said.stdout


def test_discover_finds_a_ros_2_robot_without_namespace_and_its_velocity_type(ros2):
    said = discover(ros2)
    assert said.returncode == 0, said.stderr
    assert "robot (without a namespace)" in said.stdout
    assert "geometry_msgs/msg/TwistStamped" in said.stdout


def test_discover_writes_two_bridges_to_one_fleet_file(ros1, ros2):
    said = discover("--toml", ros1, ros2)
    data = tomllib.loads(said.stdout)
    assert len(data["bridges"]) == 2
    assert len(data["robots"]) == 3


def test_discover_waits_for_an_unreachable_bridge_and_then_fails():
    said = discover("ws://127.0.0.1:1", "--wait", "2")
    assert said.returncode == 1
    assert said.stdout == ""
    assert "Waiting for the rosbridge at ws://127.0.0.1:1" in said.stderr
    assert "cannot reach" in said.stderr
    assert "Traceback" not in said.stderr
