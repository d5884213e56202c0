"""Laser scans, drawn as dots."""

import math
import time
from dataclasses import KW_ONLY
from typing import Annotated, Any

from msgspec.structs import replace

from webmap.base.errors import ProtocolError
from webmap.base.geometry import FARTHEST
from webmap.config.robot import scan_name
from webmap.modules.declaration import FoundTopic, TopicKind, layer
from webmap.modules.layer_options import Limit
from webmap.modules.robot_layer import RobotLayer
from webmap.ros.messages import LaserScanMsg
from webmap.ros.tf import Transform
from webmap.scene import svg
from webmap.scene.live import Rays

MAX_RAYS = 1 << 18
"""Greatest number of rays of a scan."""

MOST_TURN = 1000.0
"""Greatest angle of a ray, in radians: more than a hundred turns."""

LONGEST_SWEEP = 0.5
"""Seconds; a scan with a longer duration is drawn as taken at one moment."""


class SweepMsg(LaserScanMsg, frozen=True, kw_only=True):
    """A scan with its duration."""

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
    """A dot at each point that a laser scan hit.

    A scan stays on the map where the robot was at the scan's stamp. The motion of the
    robot during the scan is compensated, so that walls do not move. If the robot has
    frames, the position of the sensor comes from the frames, unless it is given here.
    The scan of an upside-down, tilted or vertical sensor is drawn as its plane looks
    from above.

    Style the dots by CSS: ``.laserscan > .dot``, and those of one of several by its
    name: ``.laserscan.rear > .dot``; their size is the custom property ``--dot-size``,
    in metres.
    """

    only_draws = True

    frame = "robot"

    x: float = 0.0
    """Position of the sensor on the robot, in metres forward."""

    y: float = 0.0
    """Position of the sensor on the robot, in metres to the left."""

    angle: float = 0.0
    """Direction of the sensor, in degrees from the robot's x, counter-clockwise."""

    max_dots: Annotated[
        int | None,
        Limit("at least 1 or None", lambda value: value is None or value >= 1),
    ] = 50
    """The greatest number of dots, evenly chosen; None for one per ray."""

    throttle: int = 300

    _: KW_ONLY

    age_limit: float = 1.0

    @classmethod
    def options_for(cls, found: FoundTopic) -> dict[str, Any]:
        """Return the options of a scan; each of several scans has its own class."""
        return {**super().options_for(found), "name": scan_name(found.number)}

    def build(self) -> None:
        """Make the path of all dots."""
        self.dots = self.add(svg.path(class_="dot"))
        self.newest_scan: tuple[LaserScanMsg, float] | None = None
        """The newest scan, and when it arrived, in seconds of ``time.monotonic()``."""

    def read(self, message: LaserScanMsg) -> Rays:
        """Return the rays, relative to the sensor at the first one.

        Raises:
            ProtocolError: If the angles are not valid, or there are too many rays.
        """
        check_rays(message)
        fault = scan_fault(message)
        if fault is not None:
            self.complain(fault)
        rays = scan_rays(message, self.max_dots)
        took = rays.total * getattr(message, "time_increment", 0.0)
        if 0.0 < took <= LONGEST_SWEEP:
            moved = self.placed.moved_within(message.frame_id, message.stamp, took)
            rays = replace(rays, moved=(moved.x, moved.y, moved.yaw))
        self.newest_scan = message, time.monotonic()
        return rays

    def draw(self, found: Rays, at: Transform) -> None:
        """Draw the dots as seen from above."""
        self.dots.set_rays(replace(found, place=at.from_above))


def scan_fault(scan: LaserScanMsg) -> str | None:
    """Return a problem of a scan that people should know; None if there is none.

    A scan with only infinite readings is no problem: the area around is empty.
    """
    ranges = scan.ranges
    count = len(ranges)
    if not count:
        return "its scans have no ranges; expected one distance for each ray"
    # A number equals itself, NaN does not; the first reading decides for most scans.
    if ranges[0] != ranges[0] and not (ranges == ranges).any():
        return (
            f"none of its {count} ranges is a number, all are null or NaN; expected "
            "metres, or infinity where nothing is"
        )
    return None


def check_rays(scan: LaserScanMsg) -> None:
    """Check that the rays of a scan have directions.

    Raises:
        ProtocolError: If an angle is not finite or too large, several rays have the
            same direction, or there are too many rays.
    """
    for name in ("angle_min", "angle_increment"):
        angle = getattr(scan, name)
        if not math.isfinite(angle):
            raise ProtocolError(f"{name} must be finite radians, got {angle}")
    count = len(scan.ranges)
    if count > MAX_RAYS:
        raise ProtocolError(f"a scan of {count} rays; the limit is {MAX_RAYS}")
    if count > 1 and scan.angle_increment == 0:
        raise ProtocolError(
            f"angle_increment must not be 0 for a scan of {count} rays, which would "
            "all have one direction"
        )
    last = scan.angle_min + scan.angle_increment * max(0, count - 1)
    if not max(abs(scan.angle_min), abs(last)) <= MOST_TURN:
        raise ProtocolError(
            f"rays must be within {MOST_TURN:g} radians, got an angle_min of "
            f"{scan.angle_min:g} and an angle_increment of {scan.angle_increment:g} "
            f"for {count} rays"
        )


def scan_rays(scan: LaserScanMsg, max_dots: int | None = None) -> Rays:
    """Return the rays of a scan, in the sensor's own frame.

    A ray counts if its range is within the sensor's limits. This leaves out the values
    of REP 117 for "too near", "nothing detected" and "bad reading".

    Args:
        scan: The scan, with finite angles.
        max_dots: The greatest number of rays, evenly chosen, so that every scan keeps
            the same bearings; None for all.

    """
    import numpy as np

    ranges = scan.ranges
    count = len(ranges)
    if max_dots is not None and count > max_dots:
        ranges = ranges[(np.arange(max_dots) * (count / max_dots)).astype(int)]
    low = scan.range_min if math.isfinite(scan.range_min) else 0.0
    high = min(scan.range_max, FARTHEST) if scan.range_max > 0 else FARTHEST
    low = max(0.0, min(low, FARTHEST))  # ranges are of single precision
    hit = np.isfinite(ranges) & (ranges >= low) & (ranges <= high)
    reach = np.where(hit, ranges, np.nan).astype("<f4").tobytes()
    return Rays(reach, count, scan.angle_min, scan.angle_increment)
