"""``webmap doctor`` against the simulator, in both dialects."""

import re
import subprocess
import sys

import pytest

from equipment.webmap_process import simulator

pytestmark = pytest.mark.slow


def webmap(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "webmap", *arguments],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.mark.serial  # rates and ages are measured
def test_doctor_reports_ros_1_robots_as_ready(ros1):
    result = webmap("doctor", ros1, "--seconds", "2")
    assert result.returncode == 0, result.stdout
    assert "0 wrong" in result.stdout
    assert re.search(r"/robot_1/odom: [12]\d\.\d messages a second", result.stdout)
    assert "Frames lead from map to robot_1/odom" in result.stdout
    assert "each call in a thread of its own" in result.stdout
    assert "/robot_0/cmd_vel has the type Twist," in result.stdout


def test_doctor_does_not_crash_the_rosapi_of_ros_2(ros2):
    result = webmap("doctor", ros2, "--seconds", "1", "--ask-parameters")
    assert result.returncode == 0, result.stdout
    assert "has the type TwistStamped" in result.stdout
    assert "may block its whole connection" in result.stdout
    assert "Scans come packed as CBOR (/base_scan)" in result.stdout
    assert webmap("discover", ros2).returncode == 0, "rosapi still runs"


def test_doctor_reports_another_client_that_advertises_a_velocity_topic():
    from websockets.sync.client import connect

    with (
        simulator("--port", "0", "--robots", "1") as url,
        connect(url, proxy=None) as other,
    ):
        other.send('{"op":"advertise","topic":"/robot_0/cmd_vel",'
                   '"type":"geometry_msgs/Twist"}')  # fmt: skip
        result = webmap("doctor", url, "--seconds", "1")
    assert "writes to /robot_0/cmd_vel now" in result.stdout


def test_doctor_reports_an_unreachable_bridge_as_wrong():
    result = webmap("doctor", "ws://127.0.0.1:1", "--wait", "0")
    assert result.returncode == 1
    assert "WRONG    The rosbridge cannot be reached" in result.stdout
    assert "Traceback" not in result.stderr


def test_doctor_checks_the_robots_of_a_topic_list(ros1, tmp_path):
    topics = tmp_path / "topics.txt"
    topics.write_text("/robot_1/odom [nav_msgs/Odometry]\n")
    result = webmap("doctor", ros1, "--seconds", "1", "--topics", str(topics))
    assert (
        "The topics come from the given list; robots found: robot_1." in result.stdout
    )
    assert "robot_0" not in result.stdout


def test_doctor_checks_robots_as_robot_and_set_options_configure_them(ros1):
    received = ("--robot", "Bob:/robot_0/odom:/robot_0/cmd_vel:")
    sent = ("--set", "Bob.velocity_type=geometry_msgs/TwistStamped")
    result = webmap("doctor", ros1, "--seconds", "2", *received, *sent)
    assert result.returncode == 1, result.stdout
    assert (
        "\nBob\n  WRONG    /robot_0/cmd_vel has the type Twist, but WebMap"
        in result.stdout
    )
    assert "configured to send TwistStamped" in result.stdout
    assert "/robot_0/odom: " in result.stdout
    assert "base_scan" not in result.stdout, "the robot has no scan topic"
    assert "they were not checked: robot_1." in result.stdout


def test_doctor_checks_robots_as_a_fleet_file_configures_them(ros1, tmp_path):
    file = tmp_path / "fleet.toml"
    file.write_text(
        f'[bridges]\nhall = "{ros1}"\n[[robots]]\nname = "Bob"\nbridge = "hall"\n'
        'odometry = "/robot_1/odom"\nscan = "/robot_1/base_scan"\n'
        '[robots.twist]\ntopic = "/robot_1/cmd_vel"\n'
        'type = "geometry_msgs/TwistStamped"\n'
    )
    result = webmap("doctor", str(file), "--seconds", "2")
    assert result.returncode == 1, result.stdout
    assert result.stdout.startswith(ros1)
    assert (
        "\nBob\n  WRONG    /robot_1/cmd_vel has the type Twist, but WebMap"
        in result.stdout
    )
    assert "/robot_1/base_scan: " in result.stdout
    assert "camera" not in result.stdout, "the file has no camera"


@pytest.mark.serial  # the time of an answer is measured
def test_doctor_with_try_call_reports_that_a_hanging_service_blocks_no_socket(ros1):
    result = webmap("doctor", ros1, "--seconds", "0.5", "--try-call")
    assert "A service that hangs blocks no other call (tried)" in result.stdout
