"""How a robot is kept from what its laser scanner sees, as the display says it."""

from typing import Literal

import msgspec

Point = tuple[float, float]
"""In metres, in the robot's frame: x forward, y left."""


class AssistSpec(msgspec.Struct, frozen=True, kw_only=True):
    """How a robot is kept from what its scanner sees."""

    topic: str
    """Of ``sensor_msgs/LaserScan``."""
    footprint: tuple[Point, ...]
    """The corners of the robot in its own frame, in order, in metres."""
    sensor: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the scanner is on it: x, y in metres, yaw in radians."""
    upside_down: bool = False
    """Whether it hangs head down, so that its rays go round the other way."""
    frame: str = ""
    """The frame that its scans must name, without a leading slash; "" for any."""
    stop_distance: float = 0.15
    """What stays free before the robot, in metres."""
    brake: float = 0.5
    """How hard the robot slows down, in metres per second squared."""
    blind: Literal["stop", "creep"] = "stop"
    """What happens while the scan is old, empty or mostly unknown."""
    creep: float = 0.1
    """The speed of creeping, in metres per second."""
