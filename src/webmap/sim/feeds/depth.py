"""A depth camera that looks down slightly; its cloud is in its optical frame."""

import math

import numpy as np
from numpy.typing import NDArray

from webmap.base.geometry import Pose
from webmap.sim.feeds.cloud import cloud_message
from webmap.sim.feeds.feed import Feed
from webmap.sim.graph_node import GraphNode
from webmap.sim.messages import Message
from webmap.sim.mounts import OPTICAL, mount, seen_from
from webmap.sim.scanner import ScannerRays, shade

FRAME = "camera_optical"
AHEAD, HEIGHT = 0.2, 0.4
"""Position of the lens on the base, in metres."""

MOUNTED = mount(AHEAD, HEIGHT, down=0.3) @ OPTICAL
"""Pose of its optical frame on the base."""

FIELD = math.radians(60)
"""Horizontal field of view, in radians."""

RISES = np.tan(np.radians(np.linspace(-40.0, 20.0, 25)))
"""Slope of each row of the picture against the horizontal."""

NEAREST, FARTHEST = 0.3, 6.0
"""Least and greatest measured distance along the floor, in metres."""

ROBOT_TOP, WALL_TOP = 0.5, 2.5
"""Heights of robots and walls, in metres."""

BEARINGS = np.linspace(-FIELD / 2, FIELD / 2, 61)
"""Angle of each column of the picture from the axis, in radians."""

POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4")])


class DepthClouds:
    """Makes ``sensor_msgs/PointCloud2`` as a camera's driver does."""

    def __init__(self, node: GraphNode) -> None:
        self._node = node
        self._rays = ScannerRays(node.world.obstacles, BEARINGS, FARTHEST)
        self.feed = Feed("camera/points", "sensor_msgs/PointCloud2", 0.2, self._make)

    def _make(self, index: int, topic: str, stamp: float) -> Message:
        robot = self._node.world.robots[index]
        seen = seen_from(MOUNTED, self.points(index))
        points = np.zeros(len(seen), POINT)
        for number, axis in enumerate("xyz"):
            points[axis] = seen[:, number]
        dialect = self._node.messages.dialect
        return cloud_message(
            dialect.header(topic, stamp, f"{robot.frames}{FRAME}"), points
        )

    def points(self, index: int) -> NDArray[np.float64]:
        """Return the points in view, in the frame of the robot's base: (N, 3)."""
        world = self._node.world
        at = world.robots[index].pose @ Pose(AHEAD)
        along_x, along_y, walls = self._rays.cast([at])[:, 0]
        walls = np.minimum(walls, 2 * FARTHEST)  # a ray without a hit has no height
        nearest = walls.copy()
        for disc in world.others(index):
            shade(nearest, along_x, along_y, at, *disc)
        found = []
        for rise in RISES:
            over = HEIGHT + nearest * rise > ROBOT_TOP
            reach = np.where(over, walls, nearest)
            if rise < 0:
                reach = np.minimum(reach, HEIGHT / -rise)
            height = HEIGHT + reach * rise
            hit = (reach >= NEAREST) & (reach <= FARTHEST) & (height < WALL_TOP)
            row = np.column_stack(
                (
                    AHEAD + reach * np.cos(BEARINGS),
                    reach * np.sin(BEARINGS),
                    height,
                )
            )
            found.append(row[hit])
        return np.concatenate(found)
