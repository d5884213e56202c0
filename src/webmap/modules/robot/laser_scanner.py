"""The readings of a laser scanner, as dots."""

import math
from functools import partial
from typing import TYPE_CHECKING

from webmap.core.dots import in_units
from webmap.core.from_above import levelled
from webmap.core.layer_names import label
from webmap.core.placed import Placed
from webmap.core.refusals import refusing
from webmap.core.scan_doubts import scan_doubt
from webmap.errors import ProtocolError
from webmap.geometry.reach import FARTHEST
from webmap.ros.bridge import Bridge
from webmap.ros.messages import LaserScanMsg
from webmap.scene import svg
from webmap.scope import Removal, keep

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from webmap.core.robot import Robot
    from webmap.geometry import Pose
    from webmap.tf import Transform

AGE_LIMIT = 1.0
"""Seconds after which a scan is drawn as old."""

MAX_RAYS = 1 << 18
"""The most rays that a scan may have."""

MOST_TURN = 1000.0
"""Radians at which a ray may be, which is more than a hundred turns."""

LONGEST_SWEEP = 0.5
"""Seconds; a scan that claims to have taken longer is taken to be of one moment."""


class SweepMsg(LaserScanMsg, frozen=True, kw_only=True):
    """A scan that says how long it took."""

    time_increment: float = 0.0
    """Seconds between neighbouring rays; 0 for a scan of one moment."""


class LaserScanner:
    """Draws a dot where each ray of a ``sensor_msgs/LaserScan`` hit something.

    A scan stays on the map where the robot was at its stamp, and what the robot turned
    and moved while the scan was taken is made up for, so that walls stand still. Of a
    robot that knows frames the sensor is where those have it, unless its place is told
    here. One that hangs upside down, is tilted or stands on its side is drawn as its
    plane looks from above.

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
        name: A further class, by which one of several is told:
            ``.laserscan.rear > .dot``.

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
        *,
        name: str = "",
    ) -> None:
        if max_dots is not None and max_dots < 1:
            raise ValueError(f"max_dots must be at least 1 or None, got {max_dots}")
        self.robot = robot
        self.max_dots = max_dots
        self.topic = topic
        self._dots = svg.path(class_="dot")
        self._placed = Placed(
            robot,
            self._dots,
            class_=f"laserscan {name}".strip(),
            frame="robot",
            x=x,
            y=y,
            angle=angle,
        )
        self.svg = self._placed.svg
        label(self.svg, topic, robot)
        keep(Removal(lambda: robot.clear_problem(self)))
        self._bridge = bridge
        bridge.subscribe(
            topic,
            refusing(robot, topic, self.on_scan),
            "sensor_msgs/LaserScan",
            throttle=throttle,
            decode=SweepMsg,
        )

    def on_scan(self, scan: LaserScanMsg) -> None:
        """Draw a scan in place of the one before.

        Raises:
            ProtocolError: If its angles make no sense, or it has too many rays.

        """
        check_rays(scan)
        doubt = scan_doubt(scan)
        if doubt is None:
            self.robot.clear_problem(self)
        else:
            self.robot.set_problem(self, f"{self.topic}: {doubt}")
        found = scan_points(scan, self.max_dots)
        if found is None:
            return
        points, rays = found
        took = len(scan.ranges) * getattr(scan, "time_increment", 0.0)
        if 0.0 < took <= LONGEST_SWEEP and len(points):
            moved = self._placed.moved_within(scan.frame_id, scan.stamp, took)
            points = straightened(points, rays / len(scan.ranges), moved)
        draw = partial(self._draw, points)
        self._placed.stand_in(scan.frame_id, scan.stamp, draw)
        self.svg.set_age(self._bridge.lag, limit=AGE_LIMIT)

    def _draw(self, points: "NDArray[np.float64]", tilt: "Transform") -> None:
        points, _ = levelled(points, tilt)
        dots, unit = in_units(points)
        self._dots.set_dots(dots.tobytes(), unit)


def check_rays(scan: LaserScanMsg) -> None:
    """Let a scan pass whose rays go somewhere.

    Raises:
        ProtocolError: If an angle is not finite or beyond all turns, several rays have
            one direction, or there are more rays than any scanner has.

    """
    for name in ("angle_min", "angle_increment"):
        angle = getattr(scan, name)
        if not math.isfinite(angle):
            raise ProtocolError(f"{name} must be finite radians, got {angle}")
    count = len(scan.ranges)
    if count > MAX_RAYS:
        raise ProtocolError(f"a scan of {count} rays; {MAX_RAYS} are the limit")
    if count > 1 and scan.angle_increment == 0:
        raise ProtocolError(
            f"angle_increment must not be 0 for a scan of {count} rays, which would "
            "all go one way"
        )
    last = scan.angle_min + scan.angle_increment * max(0, count - 1)
    if not max(abs(scan.angle_min), abs(last)) <= MOST_TURN:
        raise ProtocolError(
            f"rays must be within {MOST_TURN:g} radians, got an angle_min of "
            f"{scan.angle_min:g} and an angle_increment of {scan.angle_increment:g} "
            f"for {count} rays"
        )


def straightened(
    points: "NDArray[np.float64]", shares: "NDArray[np.float64]", moved: "Pose"
) -> "NDArray[np.float64]":
    """Return points as they would have been seen at the beginning of a sweep.

    Args:
        points: As the sensor saw them one after another, of shape (N, 2), in metres.
        shares: When, from 0 at the beginning to 1 at the end of the sweep.
        moved: Where the sensor is at the end, seen from where it was at the beginning.

    """
    import numpy as np

    turn = shares * moved.yaw
    cos, sin = np.cos(turn), np.sin(turn)
    x, y = points[:, 0], points[:, 1]
    return np.column_stack(
        (cos * x - sin * y + shares * moved.x, sin * x + cos * y + shares * moved.y)
    )


def scan_points(
    scan: LaserScanMsg, max_dots: int | None = None
) -> "tuple[NDArray[np.float64], NDArray[np.int64]] | None":
    """Return where the rays hit, in metres in the sensor's own frame.

    A ray counts if its range lies within the sensor's limits, which leaves out what
    REP 117 has a driver report for "too near", "nothing there" and "bad reading".

    Args:
        scan: The scan.
        max_dots: Keep so many at the most, evenly spread over the rays, so that the
            same bearings are kept in every scan; None for all.

    Returns:
        Points of shape (N, 2), in ray order, and the number of each one's ray; None if
        the scan's angles are not finite.

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
    high = min(scan.range_max, FARTHEST) if scan.range_max > 0 else FARTHEST
    low = max(-FARTHEST, min(low, FARTHEST))  # ranges are of single precision
    hit = np.isfinite(ranges) & (ranges >= low) & (ranges <= high)
    rays = rays[hit]
    bearings = scan.angle_min + scan.angle_increment * rays
    reach = ranges[hit].astype(np.float64)
    points = np.column_stack((reach * np.cos(bearings), reach * np.sin(bearings)))
    return points, rays
