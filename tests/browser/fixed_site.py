"""One fixed message of each kind that a layer draws, of robots at a made-up site.

Anna has frames: her sensors are mounted at odd angles, one upside down and one on its
side.
Bert has no frames: he has only odometry and layers that move with him.
Carl and Dora have only a pose.
"""

import math

import numpy as np
from fixed_messages import (
    Fields,
    battery,
    cloud,
    covariance,
    grid,
    header,
    marker,
    odometry,
    path,
    picture,
    polygon,
    pose,
    poses,
    scan,
    sonar,
    transform,
    xyz,
)

STEPS = ((0.0, 0.0), (0.4, 0.1), (0.7, 0.35), (0.9, 0.7))
"""The successive places of Anna's base in her odometry, in metres.

The places are close, so that no step is treated as a jump.
"""

LATCHED = (
    "/map",
    "/anna/map",
    "/anna/local_costmap/costmap",
    "/anna/move_base/local_costmap/costmap",
    "/tf_static",
)
"""Topics with latched messages; updates of a costmap are published repeatedly."""

DATUM = (48.4, 9.95)
"""Latitude and longitude of the map's origin, for layers that need them."""

TYPES = {
    "gps_msgs/GPSFix": (
        "std_msgs/Header header\ngps_msgs/GPSStatus status\nfloat64 latitude\n"
        "float64 longitude\nfloat64[9] position_covariance\n"
        "uint8 position_covariance_type"
    ),
    "gps_msgs/GPSStatus": "int16 status",
}
"""Types that the simulator does not know, with their fields."""

OPTICAL = (-math.pi / 2, 0.0, -math.pi / 2)
"""Of a camera that looks ahead: x to the right, y down and z forward (REP 103)."""

MOUNTS = {
    "laser": ((0.3, 0.1, 0.2), (0.0, 0.15, 0.5)),
    "rear_laser": ((-0.3, 0.05, 0.25), (math.pi, 0.0, 2.6)),
    "sonar": ((0.25, -0.1, 0.15), (0.0, -0.3, -0.4)),
    "camera_optical": ((0.2, 0.0, 0.4), (OPTICAL[0] - 0.25, *OPTICAL[1:])),
}
"""The poses of Anna's sensors on her base: metres, and turns about fixed x, y, z."""


def floor() -> np.ndarray:
    """Return a room with a thick wall, a door, a table and an unknown corner."""
    cells = np.zeros((44, 60), np.int8)
    cells[:2], cells[-2:], cells[:, :2], cells[:, -2:] = 100, 100, 100, 100
    cells[14:18, 36:44] = 100
    cells[20:26, :2] = 0
    cells[34:, 48:] = -1
    return cells


def costs(height: int, width: int) -> np.ndarray:
    """Return costs that fall from one corner, with a lethal spot."""
    rows, columns = np.mgrid[:height, :width]
    cells = np.clip(90 - 6 * np.hypot(rows, columns), 0, 98).astype(np.int8)
    cells[height // 2 : height // 2 + 2, width // 2 : width // 2 + 3] = 100
    return cells


def wall() -> list[tuple[float, ...]]:
    """Return a slanted wall and a post before a camera, in its optical frame."""
    slanted = [
        (0.19 * i - 1.0, 0.153 * j - 0.6 + 0.01 * math.sin(i), 1.8 + 0.08 * i, 10.0 * j)
        for i in range(11)
        for j in range(7)
    ]
    post = [(0.4 + 0.03 * j, 0.11 * j - 0.5, 1.0, 200.0) for j in range(6)]
    return [*slanted, *post]


def markers() -> list[Fields]:
    """Return a marker of each type, and some that are tilted or in other frames."""
    corner = [xyz(0, 0), xyz(0.6, 0), xyz(0.6, 0.5), xyz(0.1, 0.4)]
    triangles = [xyz(0, 0), xyz(0.6, 0), xyz(0, 0.6), xyz(0.7, 0), xyz(1, 0), xyz(1, 1)]
    colours = [
        dict(zip("rgba", (i / 4, 0.5, 1 - i / 4, 1.0), strict=True))
        for i in (0, 1, 2, 3)
    ]
    six = [*colours, *colours[:2]]
    tilted: Fields = {"z": 0.4, "tilt": (0.5, 0.3)}
    found = [
        marker(0, 0, pose(-5.0, 3.0, 0.4), (0.8, 0.2, 0.2)),
        marker(1, 0, pose(-3.8, 3.0), (0.1, 0.3, 0.2), points=corner[:3:2]),
        marker(2, 1, pose(-2.5, 3.0, 0.3), (0.6, 0.3, 0.4)),
        marker(3, 2, pose(-1.5, 3.0, 0.3), (0.6, 0.3, 0.4)),
        marker(4, 3, pose(-0.5, 3.0, 0.3), (0.5, 0.3, 1.0)),
        marker(5, 4, pose(0.5, 2.8), (0.06, 0, 0), points=corner),
        marker(6, 5, pose(1.5, 2.8), (0.06, 0, 0), points=corner, colors=colours),
        marker(7, 6, pose(2.5, 2.8), (0.2, 0.1, 0.1), points=corner, colors=colours),
        marker(8, 7, pose(3.5, 2.8), (0.2, 0.2, 0.2), points=corner),
        marker(9, 8, pose(4.5, 2.8), (0.1, 0.1, 0), points=corner),
        marker(10, 9, pose(-5.0, 2.2), (0, 0, 0.3), text="a text"),
        marker(11, 10, pose(-4.0, 2.2), (1, 1, 1), mesh_resource="package://a/b.dae"),
        marker(12, 11, pose(5.4, 2.8), (1, 1, 1), points=triangles, colors=six),
        marker(13, 1, pose(-2.5, 2.0, 0.3, **tilted), (0.6, 0.3, 0.4), ns="tilted"),
        marker(14, 2, pose(-1.5, 2.0, 0.3, **tilted), (0.6, 0.3, 0.4), ns="tilted"),
        marker(15, 3, pose(-0.5, 2.0, 0.3, **tilted), (0.5, 0.3, 1.0), ns="tilted"),
        marker(16, 0, pose(0.5, 2.0, 0.3, **tilted), (0.8, 0.2, 0.2), ns="tilted"),
        marker(17, 1, pose(1.0, 0.5), (0.2, 0.2, 0.2), frame="anna/odom"),
        marker(18, 1, pose(-0.5, 0.4), (0.2, 0.2, 0.2), frame="anna/base_link"),
    ]
    found[-1]["frame_locked"] = True
    return found


def frames(step: int) -> Fields:
    """Return Anna's moving frames at one of :data:`STEPS`."""
    return {
        "transforms": [
            transform("map", "anna/odom", (-2.0, -1.0, 0.0), (0.0, 0.0, 0.35)),
            transform("anna/odom", "anna/base_link", (*STEPS[step], 0.05), (0, 0, 0.4)),
        ]
    }


def mounts() -> Fields:
    """Return the frames of Anna's sensors."""
    return {
        "transforms": [
            transform("anna/base_link", f"anna/{name}", *at)
            for name, at in MOUNTS.items()
        ]
    }


def particles(*, ros2: bool) -> dict[str, tuple[str, Fields]]:
    """Return the particles of Anna, as ROS 1 or ROS 2 publishes them."""
    array = poses("map", 12, -1.5, -0.4)
    if not ros2:
        return {"/anna/particlecloud": ("geometry_msgs/PoseArray", array)}
    found = [{"pose": each, "weight": 0.1} for each in array["poses"]]
    message = {"header": header("map"), "particles": found}
    return {"/anna/particle_cloud": ("nav2_msgs/ParticleCloud", message)}


def parts() -> list[Fields]:
    """Return the diagnostics of the parts of both robots."""
    levels = (
        ("anna/base: Motors", 0),
        ("anna/base: Battery", 1),
        ("bert/base: Motors", 2),
    )
    return [
        {"level": level, "name": name, "message": "so", "hardware_id": name[:4]}
        for name, level in levels
    ]


def fix() -> Fields:
    """Return ``sensor_msgs/NavSatFix``, which ``gps_msgs/GPSFix`` is like."""
    spread = [0.09, 0.0, 0.0, 0.0, 0.09, 0.0, 0.0, 0.0, 0.36]
    return {
        "header": header("anna/base_link"),
        "status": {"status": 0},
        "latitude": DATUM[0] + 2e-5,
        "longitude": DATUM[1] - 3e-5,
        "position_covariance": spread,
        "position_covariance_type": 2,
    }


def site(step: int, *, ros2: bool) -> dict[str, tuple[str, Fields]]:
    """Return the type and the message of each topic.

    Args:
        step: The place of Anna: an index of :data:`STEPS`.
        ros2: Whether topics have the names of ROS 2.

    """
    x, y = STEPS[step]
    above = "/anna" if ros2 else "/anna/move_base"
    foot = "published_footprint" if ros2 else "footprint"
    goal = "goal_pose" if ros2 else "move_base_simple/goal"
    half = [(0.35, 0.25), (-0.35, 0.25), (-0.35, -0.25), (0.35, -0.25)]
    at_goal = {"header": header("map"), "pose": pose(4.5, 1.5, 1.2)}
    at_dock = {"header": header("anna/odom"), "pose": pose(-1.5, 1.8, -0.7)}
    lookahead = {"header": header("anna/base_link"), "point": xyz(0.8, 0.2)}
    clicked = {"header": header("map"), "point": xyz(3.0, -2.0)}
    believed = {
        "pose": pose(-1.4, -0.5, 0.9),
        "covariance": covariance(0.2, 0.05, 0.1, 0.06),
    }
    cells = [xyz(0.25 * i, 0.25 * (i % 3), 0.0) for i in range(9)]
    sides = {"cell_width": 0.25, "cell_height": 0.25}
    update = np.full((3, 4), 99, np.int8)
    patch = {"x": 12, "y": 2, "width": 4, "height": 3, "data": update.ravel().tolist()}
    local = grid("anna/odom", costs(16, 18), 0.2, pose(-1.0, -1.2))
    return {
        "/tf": ("tf2_msgs/TFMessage", frames(step)),
        "/tf_static": ("tf2_msgs/TFMessage", mounts()),
        "/map": (
            "nav_msgs/OccupancyGrid",
            grid("map", floor(), 0.2, pose(-6.0, -4.0, 0.05)),
        ),
        "/heights": (
            "nav_msgs/OccupancyGrid",
            grid("map", costs(8, 8), 0.3, pose(-5.5, -3.5)),
        ),
        "/diagnostics": ("diagnostic_msgs/DiagnosticArray", {"status": parts()}),
        "/anna/odom": ("nav_msgs/Odometry", odometry("anna", x, y, 0.4)),
        "/anna/map": (
            "nav_msgs/OccupancyGrid",
            grid("map", floor()[:8, :10], 0.1, pose(4.0, -3.6)),
        ),
        f"{above}/local_costmap/costmap": ("nav_msgs/OccupancyGrid", local),
        f"{above}/local_costmap/costmap_updates": (
            "map_msgs/OccupancyGridUpdate",
            {"header": header("anna/odom"), **patch},
        ),
        f"{above}/global_costmap/costmap": (
            "nav_msgs/OccupancyGrid",
            grid("map", costs(20, 26), 0.4, pose(-5.5, -3.9)),
        ),
        f"{above}/local_costmap/{foot}": (
            "geometry_msgs/PolygonStamped",
            polygon("anna/odom", *((x + a, y + b) for a, b in half)),
        ),
        "/anna/scan": ("sensor_msgs/LaserScan", scan("anna/laser", 2.0)),
        "/anna/rear/ranges": (
            "sensor_msgs/LaserScan",
            scan("anna/rear_laser", 1.4, 40),
        ),
        "/anna/points": (
            "sensor_msgs/PointCloud2",
            cloud("anna/camera_optical", wall()),
        ),
        "/anna/plan": (
            "nav_msgs/Path",
            path("map", (-1.7, -0.6, 0), (1, 0.5, 0), (4.5, 1.5, 1.2)),
        ),
        "/anna/local_plan": (
            "nav_msgs/Path",
            path("anna/odom", (x, y, 0.4), (2.0, 0.8, 0.5)),
        ),
        **particles(ros2=ros2),
        "/anna/trees": ("geometry_msgs/PoseArray", poses("anna/odom", 4, 3.0, -1.5)),
        "/anna/amcl_pose": (
            "geometry_msgs/PoseWithCovarianceStamped",
            {"header": header("map"), "pose": believed},
        ),
        "/anna/keep_in": (
            "geometry_msgs/PolygonStamped",
            polygon("map", (-4.0, -2.5), (2.0, -2.8), (2.5, 1.2), (-3.5, 1.0)),
        ),
        f"/anna/{goal}": ("geometry_msgs/PoseStamped", at_goal),
        "/anna/dock": ("geometry_msgs/PoseStamped", at_dock),
        "/anna/lookahead_point": ("geometry_msgs/PointStamped", lookahead),
        "/anna/clicked_point": ("geometry_msgs/PointStamped", clicked),
        "/anna/inflated_obstacles": (
            "nav_msgs/GridCells",
            {"header": header("anna/odom"), **sides, "cells": cells},
        ),
        "/anna/sonar": ("sensor_msgs/Range", sonar("anna/sonar", 1.1)),
        "/anna/sonar_aside": ("sensor_msgs/Range", sonar("anna/laser", math.inf)),
        "/anna/markers": ("visualization_msgs/MarkerArray", {"markers": markers()}),
        "/anna/marker": (
            "visualization_msgs/Marker",
            marker(0, 3, pose(5.0, -2.0), (0.5, 0.5, 0.1), ns="one"),
        ),
        "/anna/fix": ("gps_msgs/GPSFix" if ros2 else "sensor_msgs/NavSatFix", fix()),
        "/anna/battery_state": ("sensor_msgs/BatteryState", battery(0.62)),
        "/anna/camera/image_raw/compressed": (
            "sensor_msgs/CompressedImage",
            {"header": header("anna/camera"), "format": "png", "data": list(picture())},
        ),
        "/carl/pose": (
            "geometry_msgs/PoseWithCovarianceStamped",
            {
                "header": header("map"),
                "pose": {**believed, "pose": pose(-4.0, 2.0, -2.0)},
            },
        ),
        "/dora/pose2d": ("geometry_msgs/Pose2D", {"x": 3.4, "y": 0.4, "theta": -0.8}),
        "/bert/odom": ("nav_msgs/Odometry", odometry("bert", 2.2, -2.6, 2.4)),
        "/bert/scan": ("sensor_msgs/LaserScan", scan("laser", 1.5, 36)),
        "/bert/sonar": ("sensor_msgs/Range", sonar("sonar", 0.9)),
        "/bert/footprint": (
            "geometry_msgs/PolygonStamped",
            polygon("bert/odom", *half),
        ),
        "/bert/battery_state": ("sensor_msgs/BatteryState", battery(0.31)),
    }
