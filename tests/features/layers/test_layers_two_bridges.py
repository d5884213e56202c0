"""A robot behind two bridges: its poses come over one, a scan over the other."""

import asyncio
import math

import pytest
from module_fakes import dots, header, pose, to_root

from equipment.waiting import until
from webmap import Bridge, Map, Robot
from webmap.testing.witness import WitnessRobot

ZERO = {"x": 0.0, "y": 0.0, "z": 0.0}
ODOMETRY = {
    "header": header("map"),
    "child_frame_id": "base_link",
    "pose": {"pose": pose(2.0, 1.0, math.pi / 2), "covariance": [0.0] * 36},
    "twist": {"twist": {"linear": ZERO, "angular": ZERO}, "covariance": [0.0] * 36},
}
SCAN = {
    "header": header("laser"),
    "angle_min": 0.0,
    "angle_increment": 0.1,
    "range_min": 0.1,
    "range_max": 9.0,
    "ranges": [3.0],
}


def test_a_scan_of_one_bridge_is_placed_by_the_poses_of_another_bridge(
    map: Map, robot: Robot
):
    async def scenario(base: WitnessRobot, sensors: WitnessRobot) -> None:
        by_odometry, by_scan = Bridge(base.url), Bridge(sensors.url)
        robot.set_odometry_topic(by_odometry, "/odom", 0, type="nav_msgs/Odometry")
        scanner = robot.add_module("LaserScanner", by_scan, "/scan")
        map.add_robot(robot)

        def subscribed(there: WitnessRobot) -> set[str]:
            messages = [received.message for received in there.log.messages]
            return {m["topic"] for m in messages if m["op"] == "subscribe"}

        for bridge in (by_odometry, by_scan):
            bridge.start(asyncio.get_running_loop())
        try:
            await until(lambda: subscribed(base) and subscribed(sensors))
            assert (subscribed(base), subscribed(sensors)) == ({"/odom"}, {"/scan"})
            base.publish("/odom", ODOMETRY)
            await until(lambda: robot.valid)
            sensors.publish("/scan", SCAN)
            (path,) = scanner.svg.children
            await until(lambda: path._dots is not None and len(dots(path)))
            ((x, y),) = dots(path)
            assert to_root(path).apply(x, y) == pytest.approx((2.0, 4.0), abs=0.01)
        finally:
            for bridge in (by_odometry, by_scan):
                await bridge.stop()

    with WitnessRobot() as base, WitnessRobot() as sensors:
        base.sends_telemetry = sensors.sends_telemetry = False
        asyncio.run(scenario(base, sensors))
