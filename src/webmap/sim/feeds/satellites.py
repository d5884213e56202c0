"""A receiver of satellites, as if the floor had no roof."""

import math
from typing import TYPE_CHECKING

from webmap.sim.feeds.feed import Feed
from webmap.sim.messages import Message

if TYPE_CHECKING:
    from webmap.sim.node import RobotsNode

DATUM = (48.4, 9.95)
"""Latitude and longitude of the map's origin, in degrees; its x points east."""

DEVIATION = 0.3
"""Standard deviation that is claimed, in metres."""

_SEMI_MAJOR, _FLATTENING = 6378137.0, 1 / 298.257223563
_AUGMENTED, _GPS, _DIAGONAL = 1, 1, 2


class Satellites:
    """Makes ``sensor_msgs/NavSatFix`` of where robots truly are."""

    def __init__(self, node: "RobotsNode") -> None:
        self._node = node
        self.feed = Feed("fix", "sensor_msgs/NavSatFix", 0.5, self._make)

    def _make(self, index: int, topic: str, stamp: float) -> Message:
        robot = self._node.world.robots[index]
        latitude, longitude = on_the_globe(robot.pose.x, robot.pose.y)
        covariance = [0.0] * 9
        covariance[0] = covariance[4] = DEVIATION**2
        covariance[8] = (2 * DEVIATION) ** 2
        return {
            "header": self._node.messages.dialect.header(
                topic, stamp, f"{robot.frames}base_link"
            ),
            "status": {"status": _AUGMENTED, "service": _GPS},
            "latitude": latitude,
            "longitude": longitude,
            "altitude": 480.0,
            "position_covariance": covariance,
            "position_covariance_type": _DIAGONAL,
        }


def on_the_globe(x: float, y: float) -> tuple[float, float]:
    """Return latitude and longitude in degrees of a place of the map, in metres."""
    latitude = math.radians(DATUM[0])
    squared = _FLATTENING * (2 - _FLATTENING)
    bend = 1 - squared * math.sin(latitude) ** 2
    meridian = _SEMI_MAJOR * (1 - squared) / bend**1.5
    parallel = _SEMI_MAJOR / math.sqrt(bend) * math.cos(latitude)
    return (
        DATUM[0] + math.degrees(y / meridian),
        DATUM[1] + math.degrees(x / parallel),
    )
