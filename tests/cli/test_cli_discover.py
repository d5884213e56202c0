"""``webmap discover`` against the simulator, in both dialects."""

import subprocess
import sys
import tomllib


def discover(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "webmap", "discover", *arguments],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )


def test_the_robots_of_ros_1_are_found_by_namespace(ros1):
    said = discover(ros1)
    assert said.returncode == 0, said.stderr
    assert "ROS 1, 2 robots" in said.stdout
    assert "robot_1 (in /robot_1)" in said.stdout


def test_the_bare_robot_of_ros_2_is_found_with_its_type_of_velocity(ros2):
    said = discover(ros2)
    assert said.returncode == 0, said.stderr
    assert "robot (without a namespace)" in said.stdout
    assert "geometry_msgs/msg/TwistStamped" in said.stdout


def test_both_make_one_fleet_file(ros1, ros2):
    said = discover("--toml", ros1, ros2)
    data = tomllib.loads(said.stdout)
    assert len(data["bridges"]) == 2
    assert len(data["robots"]) == 3


def test_a_bridge_that_is_away_is_waited_for_and_then_said():
    said = discover("ws://127.0.0.1:1", "--wait", "2")
    assert said.returncode == 1
    assert said.stdout == ""
    assert "Waiting for the rosbridge at ws://127.0.0.1:1" in said.stderr
    assert "cannot reach" in said.stderr
    assert "Traceback" not in said.stderr
