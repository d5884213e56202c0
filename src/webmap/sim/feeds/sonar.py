"""A sonar at the front, which measures one distance."""

import math

import numpy as np

from webmap.base.geometry import Pose
from webmap.sim.feeds.feed import Feed
from webmap.sim.graph_node import GraphNode
from webmap.sim.messages import Message, float32
from webmap.sim.scanner import ScannerRays, shade

FRAME = "sonar"
MOUNTED = Pose(0.25)
"""Its pose on the base."""

FIELD = math.radians(25)
NEAREST, FARTHEST = 0.02, 4.0
_RAYS = 13
_ULTRASOUND = 0


class Sonars:
    """Makes ``sensor_msgs/Range``: the distance to the nearest obstacle in its cone."""

    def __init__(self, node: GraphNode) -> None:
        self._node = node
        bearings = np.linspace(-FIELD / 2, FIELD / 2, _RAYS)
        self._rays = ScannerRays(node.world.obstacles, bearings, FARTHEST)
        self.feed = Feed("sonar", "sensor_msgs/Range", 0.2, self._make)

    def distance(self, index: int) -> float:
        """Return the distance to the nearest obstacle in the cone; inf if none."""
        world = self._node.world
        at = world.robots[index].pose @ MOUNTED
        along_x, along_y, distances = self._rays.cast([at])[:, 0]
        for disc in world.others(index):
            shade(distances, along_x, along_y, at, *disc)
        nearest = float(distances.min())
        if nearest > FARTHEST:
            return math.inf
        return nearest if nearest >= NEAREST else -math.inf

    def _make(self, index: int, topic: str, stamp: float) -> Message:
        robot = self._node.world.robots[index]
        return {
            "header": self._node.messages.dialect.header(
                topic, stamp, f"{robot.frames}{FRAME}"
            ),
            "radiation_type": _ULTRASOUND,
            "field_of_view": float32(FIELD),
            "min_range": float32(NEAREST),
            "max_range": float32(FARTHEST),
            "range": float32(self.distance(index)),
        }
