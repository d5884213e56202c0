"""Frames in the form of rosbridge: all digits, escaped slashes, null for no range."""

import json
import math
import random
from typing import Any

import cbor2
import numpy as np

ODOM = "/robot_0/odom"
SCAN = "/robot_0/base_scan"
TYPES = {ODOM: "nav_msgs/Odometry", SCAN: "sensor_msgs/LaserScan"}

VARIANTS = 50
"""Number of different frames, so that caching has no effect."""


def header(number: int, frame: str) -> dict[str, Any]:
    """Return a header in the dialect of ROS 1."""
    stamp = {"secs": 1_700_000_000 + number, "nsecs": 372_882_366}
    return {"seq": number, "stamp": stamp, "frame_id": frame}


def odometry(number: int) -> dict[str, Any]:
    """Return one ``nav_msgs/Odometry`` message."""
    chance = random.Random(number)
    yaw = chance.uniform(-math.pi, math.pi)
    covariance = [chance.random() for _ in range(36)]
    position = {"x": chance.uniform(-20, 20), "y": chance.uniform(-20, 20), "z": 0.0}
    turn = {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
    linear = {"x": chance.random(), "y": 0.0, "z": 0.0}
    angular = {"x": 0.0, "y": 0.0, "z": chance.random()}
    return {
        "header": header(number, "robot_0/odom"),
        "child_frame_id": "robot_0/base_link",
        "pose": {
            "pose": {"position": position, "orientation": turn},
            "covariance": covariance,
        },
        "twist": {
            "twist": {"linear": linear, "angular": angular},
            "covariance": covariance,
        },
    }


def scan(number: int, beams: int = 720) -> dict[str, Any]:
    """Return one ``sensor_msgs/LaserScan`` message; one range in 17 is missing."""
    chance = random.Random(number)
    ranges: list[float | None] = [
        None if beam % 17 == 0 else float(np.float32(chance.uniform(0.2, 8.0)))
        for beam in range(beams)
    ]
    return {
        "header": header(number, "robot_0/base_laser"),
        "angle_min": -math.pi,
        "angle_max": math.pi,
        "angle_increment": math.tau / beams,
        "time_increment": 0.0,
        "scan_time": 0.1,
        "range_min": 0.1,
        "range_max": 8.0,
        "ranges": ranges,
        "intensities": [],
    }


def json_frames(topic: str, beams: int = 720) -> list[str]:
    """Return publish frames as the bridge of ROS 1 writes them with ``ujson``."""

    def make(number: int) -> dict[str, Any]:
        return odometry(number) if topic == ODOM else scan(number, beams)

    return [
        json.dumps(
            {"op": "publish", "topic": topic, "msg": make(number)},
            separators=(",", ":"),
        ).replace("/", "\\/")
        for number in range(VARIANTS)
    ]


def cbor_frames() -> list[bytes]:
    """Return scans with the ranges as one typed array: tag 85, float32, little."""
    frames = []
    for number in range(VARIANTS):
        message = scan(number)
        ranges = [math.nan if r is None else r for r in message["ranges"]]
        message["ranges"] = cbor2.CBORTag(85, np.array(ranges, "<f4").tobytes())
        message["intensities"] = cbor2.CBORTag(85, b"")
        publish = {"op": "publish", "topic": SCAN, "msg": message}
        frames.append(cbor2.dumps(publish))
    return frames
