import math
import subprocess
import sys

import pytest
from simulated import Bench

from webmap.base.geometry import Pose, Quaternion


def as_pose(translation, rotation):
    turn = Quaternion(**rotation)
    return Pose(translation["x"], translation["y"], turn.yaw)


def transforms(client, topic):
    found = {}
    for message in client.operations("publish", topic):
        for t in message["msg"]["transforms"]:
            at = t["transform"]
            key = (t["header"]["frame_id"], t["child_frame_id"])
            found[key] = as_pose(at["translation"], at["rotation"])
    return found


@pytest.mark.parametrize("drift", [0.0, 0.1])
def test_the_transforms_lead_from_the_map_to_the_true_pose(drift):
    bench = Bench(drift=drift)
    client = bench.client()
    client.send(op="subscribe", topic="/tf")
    for _ in range(40):
        message = {"linear": {"x": 0.5}, "angular": {"z": 0.4}}
        client.send(op="publish", topic="/robot_0/cmd_vel", msg=message)
        bench.run(0.05)
    found = transforms(client, "/tf")
    map_from_odom = found["map", "robot_0/odom"]
    at = map_from_odom @ found["robot_0/odom", "robot_0/base_link"]
    robot = bench.world.robots[0]
    assert math.dist((at.x, at.y), (robot.pose.x, robot.pose.y)) < 1e-9
    moved = math.hypot(map_from_odom.x, map_from_odom.y)
    assert (moved > 0.001) == (drift > 0)


def test_the_static_transform_of_the_scanner_is_latched():
    bench = Bench()
    bench.run(1)
    client = bench.client()
    client.send(op="subscribe", topic="/tf_static")
    found = transforms(client, "/tf_static")
    assert found["robot_1/base_link", "robot_1/base_laser"] == Pose()


def test_without_drift_odometry_equals_the_pose_on_the_map():
    bench = Bench("ros2")
    client = bench.client()
    client.send(op="subscribe", topic="/robot_1/odom")
    bench.run(0.05)
    pose = client.operations()[0]["msg"]["pose"]["pose"]
    at = as_pose(pose["position"], pose["orientation"])
    robot = bench.world.robots[1].pose
    assert (at.x, at.y, at.yaw) == pytest.approx((robot.x, robot.y, robot.yaw))


def test_a_scan_message_contains_its_angles_and_its_frame():
    bench = Bench()
    client = bench.client()
    client.send(op="subscribe", topic="/robot_0/base_scan")
    bench.run(0.1)
    scan = client.operations()[0]["msg"]
    assert scan["angle_min"] == pytest.approx(-math.pi, abs=1e-6)
    last = scan["angle_min"] + (len(scan["ranges"]) - 1) * scan["angle_increment"]
    assert scan["angle_max"] == pytest.approx(last, abs=1e-5)
    assert scan["header"]["frame_id"] == "robot_0/base_laser"


def test_importing_the_simulator_loads_no_heavy_library():
    code = (
        "import sys, webmap.sim;"
        "sys.exit(any(m in sys.modules for m in ('numpy', 'PIL', 'websockets')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
