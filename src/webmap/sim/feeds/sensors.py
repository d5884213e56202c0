"""Sensors besides the scanner: a lidar with several rings, a depth camera, a sonar.

The cloud of the lidar has walls, robots and the floor. The depth camera looks down
slightly, and its cloud is in its optical frame. The sonar at the front measures one
distance.
"""

import math

import numpy as np
from numpy.typing import NDArray

from webmap.base.geometry import Pose
from webmap.sim.messages import Feed, GraphNode, Message, float32
from webmap.sim.scanner import (
    LASER_HEIGHT,
    OPTICAL,
    ScannerRays,
    mount,
    seen_from,
    shade,
)

_RINGS = np.radians([-6.0, 0.0, 6.0, 12.0])
"""Elevation of each ring above the horizontal, in radians."""

_LIDAR_ROBOT_HEIGHT = 0.3
"""Height of robots above the lidar, in metres; walls are higher than its view."""

LIDAR_POINT = np.dtype(
    {
        "names": ["x", "y", "z", "intensity", "ring"],
        "formats": ["<f4", "<f4", "<f4", "<f4", "<u2"],
        # Layout of drivers of spinning lidars: aligned for SSE, with a gap after z.
        "offsets": [0, 4, 8, 16, 20],
        "itemsize": 32,
    }
)
_DATATYPES = {"<f4": 7, "<u2": 4}


class Clouds:
    """Makes ``sensor_msgs/PointCloud2``, in the frame of the scanner."""

    def __init__(self, node: GraphNode) -> None:
        self._node = node
        type = "sensor_msgs/PointCloud2"
        self.feed = Feed("points", type, 0.2, "base_laser", self._make)

    def _make(self, index: int) -> Message:
        world = self._node.world
        whole = world.sweep([index])[0]
        walls = world.scanner.sweep([world.robots[index].pose])[0]
        points = cloud_points(whole, walls)
        if self._node.tilted:
            points["y"] *= -1
            points["z"] *= -1
        return cloud_message(points)


def cloud_message(points: NDArray[np.void]) -> Message:
    """Return ``sensor_msgs/PointCloud2`` of points with named fields, of shape (N,)."""
    layout = points.dtype
    return {
        "height": 1,
        "width": len(points),
        "fields": [
            {
                "name": name,
                "offset": layout.fields[name][1] if layout.fields else 0,
                "datatype": _DATATYPES[layout[name].str],
                "count": 1,
            }
            for name in layout.names or ()
        ],
        "is_bigendian": False,
        "point_step": layout.itemsize,
        "row_step": layout.itemsize * len(points),
        "data": points.tobytes(),
        "is_dense": True,
    }


def cloud_points(
    whole: NDArray[np.float32], walls: NDArray[np.float32]
) -> NDArray[np.void]:
    """Return the points of all rings, ring by ring, of the type :data:`LIDAR_POINT`.

    Args:
        whole: The ranges of a level sweep over the full circle, starting at -pi.
        walls: The same ranges without other robots.

    """
    bearings = -math.pi + np.arange(len(whole)) * (math.tau / len(whole))
    parts = []
    for number, rise in enumerate(np.tan(_RINGS)):
        over = whole > (_LIDAR_ROBOT_HEIGHT / rise if rise > 0 else np.inf)
        reach = np.where(over, walls, whole).astype(np.float64)
        if rise < 0:
            reach = np.minimum(reach, LASER_HEIGHT / -rise)
        hit = np.isfinite(reach) & (reach > 0)
        ring = np.zeros(int(hit.sum()), LIDAR_POINT)
        ring["x"] = reach[hit] * np.cos(bearings[hit])
        ring["y"] = reach[hit] * np.sin(bearings[hit])
        ring["z"] = reach[hit] * rise
        ring["intensity"] = 100 / (1 + reach[hit])
        ring["ring"] = number
        parts.append(ring)
    # np.concatenate would remove the gaps.
    points = np.empty(sum(map(len, parts)), LIDAR_POINT)
    begin = 0
    for part in parts:
        points[begin : begin + len(part)] = part
        begin += len(part)
    return points


CAMERA_FRAME = "camera_optical"
_CAMERA_AHEAD, _CAMERA_HEIGHT = 0.2, 0.4
"""Position of the lens on the base, in metres."""

CAMERA_POSE = mount(_CAMERA_AHEAD, _CAMERA_HEIGHT, down=0.3) @ OPTICAL
"""Pose of its optical frame on the base."""

_CAMERA_FIELD = math.radians(60)
"""Horizontal field of view, in radians."""

_RISES = np.tan(np.radians(np.linspace(-40.0, 20.0, 25)))
"""Slope of each row of the picture against the horizontal."""

_CAMERA_LEAST, _CAMERA_MOST = 0.3, 6.0
"""Least and greatest measured distance along the floor, in metres."""

_ROBOT_HEIGHT, _WALL_HEIGHT = 0.5, 2.5
"""Heights of robots and walls, in metres."""

_BEARINGS = np.linspace(-_CAMERA_FIELD / 2, _CAMERA_FIELD / 2, 61)
"""Angle of each column of the picture from the axis, in radians."""

CAMERA_POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4")])


class DepthClouds:
    """Makes ``sensor_msgs/PointCloud2`` as a camera's driver does."""

    def __init__(self, node: GraphNode) -> None:
        self._node = node
        self._rays = ScannerRays(node.world.obstacles, _BEARINGS, _CAMERA_MOST)
        type = "sensor_msgs/PointCloud2"
        self.feed = Feed("camera/points", type, 0.2, CAMERA_FRAME, self._make)

    def _make(self, index: int) -> Message:
        seen = seen_from(CAMERA_POSE, self.points(index))
        points = np.zeros(len(seen), CAMERA_POINT)
        for number, axis in enumerate("xyz"):
            points[axis] = seen[:, number]
        return cloud_message(points)

    def points(self, index: int) -> NDArray[np.float64]:
        """Return the points in view, in the frame of the robot's base: (N, 3)."""
        world = self._node.world
        at = world.robots[index].pose @ Pose(_CAMERA_AHEAD)
        along_x, along_y, walls = self._rays.cast([at])[:, 0]
        walls = np.minimum(walls, 2 * _CAMERA_MOST)  # a ray without a hit has no height
        nearest = walls.copy()
        for disc in world.others(index):
            shade(nearest, along_x, along_y, at, *disc)
        found = []
        for rise in _RISES:
            over = _CAMERA_HEIGHT + nearest * rise > _ROBOT_HEIGHT
            reach = np.where(over, walls, nearest)
            if rise < 0:
                reach = np.minimum(reach, _CAMERA_HEIGHT / -rise)
            height = _CAMERA_HEIGHT + reach * rise
            hit = (
                (reach >= _CAMERA_LEAST)
                & (reach <= _CAMERA_MOST)
                & (height < _WALL_HEIGHT)
            )
            row = np.column_stack(
                (
                    _CAMERA_AHEAD + reach * np.cos(_BEARINGS),
                    reach * np.sin(_BEARINGS),
                    height,
                )
            )
            found.append(row[hit])
        return np.concatenate(found)


SONAR_FRAME = "sonar"
SONAR_POSE = Pose(0.25)
"""Its pose on the base."""

_SONAR_FIELD = math.radians(25)
_SONAR_NEAREST, _SONAR_FARTHEST = 0.02, 4.0
_SONAR_RAYS = 13
_ULTRASOUND = 0


class Sonars:
    """Makes ``sensor_msgs/Range``: the distance to the nearest obstacle in its cone."""

    def __init__(self, node: GraphNode) -> None:
        self._node = node
        bearings = np.linspace(-_SONAR_FIELD / 2, _SONAR_FIELD / 2, _SONAR_RAYS)
        self._rays = ScannerRays(node.world.obstacles, bearings, _SONAR_FARTHEST)
        self.feed = Feed("sonar", "sensor_msgs/Range", 0.2, SONAR_FRAME, self._make)

    def distance(self, index: int) -> float:
        """Return the distance to the nearest obstacle in the cone; inf if none."""
        world = self._node.world
        at = world.robots[index].pose @ SONAR_POSE
        along_x, along_y, distances = self._rays.cast([at])[:, 0]
        for disc in world.others(index):
            shade(distances, along_x, along_y, at, *disc)
        nearest = float(distances.min())
        if nearest > _SONAR_FARTHEST:
            return math.inf
        return nearest if nearest >= _SONAR_NEAREST else -math.inf

    def _make(self, index: int) -> Message:
        made = {
            "radiation_type": _ULTRASOUND,
            "field_of_view": float32(_SONAR_FIELD),
            "min_range": float32(_SONAR_NEAREST),
            "max_range": float32(_SONAR_FARTHEST),
            "range": float32(self.distance(index)),
        }
        ros2 = self._node.graph.schema.dialect.is_ros2
        return made | ({"variance": 0.0} if ros2 else {})
