"""A lidar with several rings; its cloud has walls, robots and the floor."""

import math

import numpy as np
from numpy.typing import NDArray

from webmap.sim.feeds.feed import Feed
from webmap.sim.graph_node import GraphNode
from webmap.sim.messages import Message
from webmap.sim.mounts import LASER_HEIGHT

RINGS = np.radians([-6.0, 0.0, 6.0, 12.0])
"""Elevation of each ring above the horizontal, in radians."""

ROBOT_TOP = 0.3
"""Height of robots above the lidar, in metres; walls are higher than its view."""

POINT = np.dtype(
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
        self.feed = Feed("points", "sensor_msgs/PointCloud2", 0.2, self._make)

    def _make(self, index: int, topic: str, stamp: float) -> Message:
        world = self._node.world
        robot = world.robots[index]
        whole = world.sweep([index])[0]
        walls = world.scanner.sweep([robot.pose])[0]
        points = cloud_points(whole, walls)
        if self._node.tilted:
            points["y"] *= -1
            points["z"] *= -1
        dialect = self._node.messages.dialect
        return cloud_message(
            dialect.header(topic, stamp, f"{robot.frames}base_laser"), points
        )


def cloud_message(header: Message, points: NDArray[np.void]) -> Message:
    """Return ``sensor_msgs/PointCloud2`` of points with named fields.

    Args:
        header: Its header.
        points: The points, of shape (N,).

    """
    layout = points.dtype
    return {
        "header": header,
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
    """Return the points of all rings, ring by ring, of the type :data:`POINT`.

    Args:
        whole: The ranges of a level sweep over the full circle, starting at -pi.
        walls: The same ranges without other robots.

    """
    bearings = -math.pi + np.arange(len(whole)) * (math.tau / len(whole))
    parts = []
    for number, rise in enumerate(np.tan(RINGS)):
        over = whole > (ROBOT_TOP / rise if rise > 0 else np.inf)
        reach = np.where(over, walls, whole).astype(np.float64)
        if rise < 0:
            reach = np.minimum(reach, LASER_HEIGHT / -rise)
        hit = np.isfinite(reach) & (reach > 0)
        ring = np.zeros(int(hit.sum()), POINT)
        ring["x"] = reach[hit] * np.cos(bearings[hit])
        ring["y"] = reach[hit] * np.sin(bearings[hit])
        ring["z"] = reach[hit] * rise
        ring["intensity"] = 100 / (1 + reach[hit])
        ring["ring"] = number
        parts.append(ring)
    # np.concatenate would remove the gaps.
    points = np.empty(sum(map(len, parts)), POINT)
    begin = 0
    for part in parts:
        points[begin : begin + len(part)] = part
        begin += len(part)
    return points
