"""The readings of a laser scanner, as dots."""

import math
from dataclasses import KW_ONLY
from typing import TYPE_CHECKING, Annotated, Any

from webmap.base.errors import ProtocolError
from webmap.base.geometry import FARTHEST
from webmap.config.robot import scan_name
from webmap.modules.declaration import FoundTopic, TopicKind, layer
from webmap.modules.drawing import in_units, levelled
from webmap.modules.layer_options import Limit
from webmap.modules.robot_layer import RobotLayer
from webmap.ros.messages import LaserScanMsg
from webmap.ros.tf import Transform
from webmap.scene import svg

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from webmap.base.geometry import Pose

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


@layer(
    "sensor_msgs/LaserScan",
    view=SweepMsg,
    kinds=[
        TopicKind(
            "scan",
            {r"/(?:base_)?scan\Z": "the usual name", "": "its type alone"},
            most=6,
            options={"max_dots": None, "throttle": 100},
            role="scan",
        )
    ],
    switch="Scans",
    css="laserscan",
    rank=20,
)
class LaserScanner(RobotLayer):
    """A dot where each ray of a laser scan hit something.

    A scan stays on the map where the robot was at its stamp, and what the robot turned
    and moved while the scan was taken is made up for, so that walls stand still. Of a
    robot that knows frames the sensor is where those have it, unless its place is told
    here. One that hangs upside down, is tilted or stands on its side is drawn as its
    plane looks from above.

    Style the dots by CSS: ``.laserscan > .dot``, and those of one of several by its
    name: ``.laserscan.rear > .dot``; their size is the custom property ``--dot-size``,
    in metres.
    """

    frame = "robot"

    x: float = 0.0
    """Where the sensor is on the robot, in metres forward."""

    y: float = 0.0
    """In metres to the left."""

    angle: float = 0.0
    """Where it looks, in degrees from the robot's x, counter-clockwise."""

    max_dots: Annotated[
        int | None,
        Limit("at least 1 or None", lambda value: value is None or value >= 1),
    ] = 50
    """How many dots are drawn at the most, evenly chosen; None for one per ray."""

    throttle: int = 300

    _: KW_ONLY

    age_limit: float = 1.0

    @classmethod
    def options_for(cls, found: FoundTopic) -> dict[str, Any]:
        """Return the options of a scan, with a class of its own for each of several."""
        return {**super().options_for(found), "name": scan_name(found.number)}

    def build(self) -> None:
        """Make the path of all dots."""
        self.dots = self.add(svg.path(class_="dot"))

    def read(self, message: LaserScanMsg) -> "NDArray[np.float64]":
        """Return where the rays hit, as the sensor was when the first one did.

        Raises:
            ProtocolError: If its angles make no sense, or it has too many rays.

        """
        check_rays(message)
        doubt = scan_doubt(message)
        if doubt is not None:
            self.complain(doubt)
        points, rays = scan_points(message, self.max_dots)
        took = len(message.ranges) * getattr(message, "time_increment", 0.0)
        if 0.0 < took <= LONGEST_SWEEP and len(points):
            moved = self.placed.moved_within(message.frame_id, message.stamp, took)
            points = straightened(points, rays / len(message.ranges), moved)
        return points

    def draw(self, found: "NDArray[np.float64]", at: Transform) -> None:
        """Draw the dots as they look from above."""
        points, _ = levelled(found, at)
        dots, unit = in_units(points)
        self.dots.set_dots(dots.tobytes(), unit)


def scan_doubt(scan: LaserScanMsg) -> str | None:
    """Return what a person should know of a scan; None if it is as it should be.

    A scan all of whose readings are infinite is not odd: it is one of an empty field.
    """
    ranges = scan.ranges
    count = len(ranges)
    if not count:
        return "its scans have no ranges; expected one distance for each ray"
    # A number is itself, NaN is not; the first settles it for nearly every scan.
    if ranges[0] != ranges[0] and not (ranges == ranges).any():
        return (
            f"none of its {count} ranges is a number, all are null or NaN; expected "
            "metres, or infinity where nothing is"
        )
    return None


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
) -> "tuple[NDArray[np.float64], NDArray[np.int64]]":
    """Return where the rays hit, in metres in the sensor's own frame.

    A ray counts if its range lies within the sensor's limits, which leaves out what
    REP 117 has a driver report for "too near", "nothing there" and "bad reading".

    Args:
        scan: The scan, whose angles are finite.
        max_dots: Keep so many at the most, evenly spread over the rays, so that the
            same bearings are kept in every scan; None for all.

    Returns:
        Points of shape (N, 2), in ray order, and the number of each one's ray.

    """
    import numpy as np

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
