"""The readings of a laser scanner, as dots."""

import logging
import math
from typing import TYPE_CHECKING

from webmap.ros.bridge import Bridge
from webmap.ros.messages import LaserScanMsg
from webmap.scene import svg

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from webmap.core.robot import Robot

log = logging.getLogger("webmap.modules.laser_scanner")

UNIT = 0.001
"""Metres per unit of the dots on the wire, as long as they fit in 16 bits."""

AGE_LIMIT = 1.0
"""Seconds after which a scan is drawn as old."""


class LaserScanner:
    """Draws a dot where each ray of a ``sensor_msgs/LaserScan`` hit something.

    The dots can be styled by CSS: ``.laserscan > .dot``; their size is the custom
    property ``--dot-size``, in metres.

    Args:
        robot: The robot that carries the sensor.
        bridge: The link to the ROS system that has the topic.
        topic: The topic.
        x: Where the sensor is on the robot, in metres forward.
        y: In metres to the left.
        angle: Where it looks, in degrees from the robot's x, counter-clockwise.
        max_dots: How many dots are drawn at the most; None for one per ray.
        throttle: The least time between two scans, in milliseconds.

    Raises:
        ValueError: If ``max_dots`` is less than 1.

    """

    def __init__(
        self,
        robot: "Robot",
        bridge: Bridge,
        topic: str,
        x: float = 0.0,
        y: float = 0.0,
        angle: float = 0.0,
        max_dots: int | None = 50,
        throttle: int = 300,
    ) -> None:
        if max_dots is not None and max_dots < 1:
            raise ValueError(f"max_dots must be at least 1 or None, got {max_dots}")
        self.robot = robot
        self.max_dots = max_dots
        self.topic = topic
        self._dots = svg.path(class_="dot")
        self.svg = svg.g(self._dots, class_="laserscan")
        self.svg.set_pose(x, y, math.radians(angle))
        robot.svg.append(self.svg)
        bridge.subscribe(
            topic,
            self.on_scan,
            "sensor_msgs/LaserScan",
            throttle=throttle,
            decode=LaserScanMsg,
        )

    def destroy(self) -> None:
        """Take the dots away."""
        self.svg.remove()

    def on_scan(self, scan: LaserScanMsg) -> None:
        """Draw a scan in place of the one before."""
        points = scan_points(scan, self.max_dots)
        if points is None:
            log.debug("%s: a scan without a usable angle was ignored", self.topic)
            return
        unit = UNIT
        if len(points):
            reach = float(abs(points).max())
            unit = max(UNIT, reach / 32767)
        dots = (points / unit).round().astype("<i2")
        self._dots.set_dots(dots.tobytes(), unit)
        self.svg.set_age(0.0, limit=AGE_LIMIT)


def scan_points(
    scan: LaserScanMsg, max_dots: int | None = None
) -> "NDArray[np.float64] | None":
    """Return where the rays hit, in metres in the sensor's own frame.

    A ray counts if its range lies within the sensor's limits, which leaves out what
    REP 117 has a driver report for "too near", "nothing there" and "bad reading".

    Args:
        scan: The scan.
        max_dots: Keep so many at the most, evenly spread over the rays, so that the
            same bearings are kept in every scan; None for all.

    Returns:
        Shape (N, 2), in ray order; None if the scan's angles are not finite.

    """
    import numpy as np

    if not (math.isfinite(scan.angle_min) and math.isfinite(scan.angle_increment)):
        return None
    ranges = scan.ranges
    rays = np.arange(len(ranges))
    if max_dots is not None and len(ranges) > max_dots:
        rays = (np.arange(max_dots) * (len(ranges) / max_dots)).astype(int)
        ranges = ranges[rays]
    low = scan.range_min if math.isfinite(scan.range_min) else 0.0
    high = scan.range_max if scan.range_max > 0 else math.inf
    hit = np.isfinite(ranges) & (ranges >= low) & (ranges <= high)
    bearings = scan.angle_min + scan.angle_increment * rays[hit]
    reach = ranges[hit].astype(np.float64)
    return np.column_stack((reach * np.cos(bearings), reach * np.sin(bearings)))
