"""Clients of other projects, with the simulator's server."""

import json
import math
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from simulated import running

HERE = Path(__file__).parent
ROOT = HERE.parents[1]

pytestmark = pytest.mark.peer


def output_of(*command):
    """Run a client to its end and return its output."""
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_roslibpy_works_with_the_simulator(dialect):
    with running("--dialect", dialect) as url:
        received = output_of(
            sys.executable, str(HERE / "roslibpy_client.py"), url, dialect
        )
    ros2 = dialect == "ros2"
    assert {"/map", "/robot_0/odom", "/robot_1/base_scan"} <= set(received["topics"])
    assert received["odom_type"] == (
        "nav_msgs/msg/Odometry" if ros2 else "nav_msgs/Odometry"
    )
    assert received["odom_topics"] == ["/robot_0/odom", "/robot_1/odom"]
    assert {"/robot_0/stop", "/rosapi/topics"} <= set(received["services"])
    assert received["stop_type"] == (
        "std_srvs/srv/Trigger" if ros2 else "std_srvs/Trigger"
    )
    assert "/robots" in received["nodes"]
    assert "/robot_0/cmd_vel" in received["details"]["subscribing"]
    assert received["ranges"] == 360
    assert received["cells"] == 840 * 540
    assert received["way"] > 0.3
    assert received["stop"] == {"success": True, "message": "stopped"}
    if not ros2:
        assert received["time"]["secs"] > 1_600_000_000
        assert received["twist"]["typedefs"][0]["fieldnames"] == ["linear", "angular"]
        assert received["params"] == []
        assert received["goal"] == 3


@pytest.mark.parametrize("package", ["roslib", "roslib2"])
@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_roslib_works_with_the_simulator(dialect, package):
    node = shutil.which("node")
    if node is None or not (ROOT / "node_modules" / package).is_dir():
        pytest.skip(f"needs node, and {package} from npm")
    with running("--dialect", dialect) as url:
        received = output_of(
            node, str(HERE / "roslib_client.mjs"), url, dialect, package
        )
    ros2 = dialect == "ros2"
    odometry = "nav_msgs/msg/Odometry" if ros2 else "nav_msgs/Odometry"
    assert received["topics"]["/robot_0/odom"] == odometry
    assert received["odomType"] == odometry
    assert received["odomTopics"] == ["/robot_0/odom", "/robot_1/odom"]
    assert received["stopType"] == (
        "std_srvs/srv/Trigger" if ros2 else "std_srvs/Trigger"
    )
    assert {"/robots", "/rosapi"} <= set(received["nodes"])
    assert "/rosapi/topics" in received["services"]
    action = "/robot_0/navigate_to_pose" if ros2 else "/robot_0/move_base"
    assert action in received["actionServers"]
    assert set(received["ranges"].values()) == {360}
    assert {"none", "cbor"} <= set(received["ranges"])
    assert received["cells"] == received["size"][0] * received["size"][1] == 840 * 540
    before, after = received["before"], received["after"]
    assert math.hypot(after["x"] - before["x"], after["y"] - before["y"]) > 0.3
    assert received["stop"] == {"success": True, "message": "stopped"}
    assert "does not exist" in received["missing"]
    assert received["served"] == {"success": True, "message": "from roslib"}
    if not ros2:
        assert (
            received["twist"][0]
            if isinstance(received["twist"], list)
            else received["twist"]
        )
        assert received["goal"] == 3
    elif package == "roslib2":
        assert received["goal"]["error_code"] == 0
