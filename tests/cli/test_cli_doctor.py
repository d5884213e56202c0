"""``webmap doctor`` against the simulator, in both dialects."""

import re
import subprocess
import sys

import pytest

from webmap_process import simulator

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
    said = webmap("doctor", ros1, "--seconds", "2")
    assert said.returncode == 0, said.stdout
    assert "0 wrong" in said.stdout
    assert re.search(r"/robot_1/odom: [12]\d\.\d messages a second", said.stdout)
    assert "Frames lead from map to robot_1/odom" in said.stdout
    assert "each call in a thread of its own" in said.stdout
    assert "/robot_0/cmd_vel has the type Twist," in said.stdout


def test_doctor_does_not_crash_the_rosapi_of_ros_2(ros2):
    said = webmap("doctor", ros2, "--seconds", "1", "--ask-parameters")
    assert said.returncode == 0, said.stdout
    assert "has the type TwistStamped" in said.stdout
    assert "may block its whole connection" in said.stdout
    assert "Scans come packed as CBOR (/base_scan)" in said.stdout
    assert webmap("discover", ros2).returncode == 0, "rosapi is still there"


def test_doctor_reports_another_client_that_advertises_a_velocity_topic():
    from websockets.sync.client import connect

    with (
        simulator("--port", "0", "--robots", "1") as url,
        connect(url, proxy=None) as other,
    ):
        other.send('{"op":"advertise","topic":"/robot_0/cmd_vel",'
                   '"type":"geometry_msgs/Twist"}')  # fmt: skip
        said = webmap("doctor", url, "--seconds", "1")
    assert "writes to /robot_0/cmd_vel now" in said.stdout


def test_doctor_reports_an_unreachable_bridge_as_wrong():
    said = webmap("doctor", "ws://127.0.0.1:1", "--wait", "0")
    assert said.returncode == 1
    assert "WRONG    The rosbridge cannot be reached" in said.stdout
    assert "Traceback" not in said.stderr


def test_doctor_checks_the_robots_of_a_topic_list(ros1, tmp_path):
    topics = tmp_path / "topics.txt"
    topics.write_text("/robot_1/odom [nav_msgs/Odometry]\n")
    said = webmap("doctor", ros1, "--seconds", "1", "--topics", str(topics))
    assert "The topics come from the given list; robots found: robot_1." in said.stdout
    assert "robot_0" not in said.stdout


def test_doctor_checks_robots_as_robot_and_set_options_configure_them(ros1):
    received = ("--robot", "Bob:/robot_0/odom:/robot_0/cmd_vel:")
    sent = ("--set", "Bob.velocity_type=geometry_msgs/TwistStamped")
    said = webmap("doctor", ros1, "--seconds", "2", *received, *sent)
    assert said.returncode == 1, said.stdout
    assert (
        "\nBob\n  WRONG    /robot_0/cmd_vel has the type Twist, but WebMap"
        in said.stdout
    )
    assert "configured to send TwistStamped" in said.stdout
    assert "/robot_0/odom: " in said.stdout
    assert "base_scan" not in said.stdout, "it was given no scan"
    assert "they were not checked: robot_1." in said.stdout


def test_doctor_checks_robots_as_a_fleet_file_configures_them(ros1, tmp_path):
    file = tmp_path / "fleet.toml"
    file.write_text(
        f'[bridges]\nhall = "{ros1}"\n[[robots]]\nname = "Bob"\nbridge = "hall"\n'
        'odometry = "/robot_1/odom"\nscan = "/robot_1/base_scan"\n'
        '[robots.twist]\ntopic = "/robot_1/cmd_vel"\n'
        'type = "geometry_msgs/TwistStamped"\n'
    )
    said = webmap("doctor", str(file), "--seconds", "2")
    assert said.returncode == 1, said.stdout
    assert said.stdout.startswith(ros1)
    assert (
        "\nBob\n  WRONG    /robot_1/cmd_vel has the type Twist, but WebMap"
        in said.stdout
    )
    assert "/robot_1/base_scan: " in said.stdout
    assert "camera" not in said.stdout, "the file has none"


@pytest.mark.serial  # how long an answer takes is measured
def test_doctor_with_try_call_reports_that_a_hanging_service_blocks_no_socket(ros1):
    said = webmap("doctor", ros1, "--seconds", "0.5", "--try-call")
    assert "A service that hangs blocks no other call (tried)" in said.stdout
