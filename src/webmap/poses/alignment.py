"""Alignments of the maps of a robot or a whole ROS system on the common map."""

import itertools
import math
import weakref
from collections.abc import Callable

from webmap.base.errors import ConfigError
from webmap.base.geometry import Pose
from webmap.base.scope import Removal
from webmap.ros.bridge import Bridge

_numbers = itertools.count(1)

FARTHEST = 1e6
"""The greatest distance of a map, in metres."""

HERE = Pose()
"""The alignment of a map that coincides with the common one."""


def alignment(x: float, y: float, angle: float) -> Pose:
    """Return an alignment: the pose of a map's origin on the common map.

    Args:
        x: Metres along the common map's x.
        y: Metres along its y.
        angle: Degrees, counter-clockwise.

    Raises:
        ConfigError: If a value is not a number, or beyond the limit.

    """
    for name, value in (("x", x), ("y", y), ("angle", angle)):
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not math.isfinite(value) or abs(value) > FARTHEST:
            raise ConfigError(
                f"an alignment is x and y in metres and an angle in degrees, each "
                f"from {-FARTHEST:g} to {FARTHEST:g}, got {value!r} as {name}"
            )
    return Pose(float(x), float(y), math.remainder(math.radians(angle), math.tau))


def numbers(pose: Pose) -> tuple[float, float, float]:
    """Return x and y in metres and the angle in degrees, rounded for display."""
    angle = round(math.degrees(pose.yaw), 2) + 0.0
    return (round(pose.x, 3) + 0.0, round(pose.y, 3) + 0.0, angle)


def toml_line(pose: Pose) -> str:
    """Return the line of a fleet file that sets an alignment."""
    x, y, angle = numbers(pose)
    return f"alignment = [{x}, {y}, {angle}] # metres, metres, degrees"


class Alignments:
    """The alignments of bridges, and the listeners for changes."""

    def __init__(self) -> None:
        self._poses: weakref.WeakKeyDictionary[Bridge, Pose] = (
            weakref.WeakKeyDictionary()
        )
        self._marks: weakref.WeakKeyDictionary[Bridge, str] = (
            weakref.WeakKeyDictionary()
        )
        self._listeners: weakref.WeakKeyDictionary[
            Bridge, dict[int, Callable[[], object]]
        ] = weakref.WeakKeyDictionary()

    def of(self, bridge: Bridge | None) -> Pose:
        """Return the alignment of a bridge; the identity if none is set."""
        return HERE if bridge is None else self._poses.get(bridge, HERE)

    def stated(self, bridge: Bridge) -> Pose | None:
        """Return the alignment of a bridge; None if none was ever set."""
        return self._poses.get(bridge)

    def mark(self, bridge: Bridge) -> str:
        """Return the page's identifier for the layers of a bridge."""
        if bridge not in self._marks:
            self._marks[bridge] = f"b{next(_numbers)}"
        return self._marks[bridge]

    def set(self, bridge: Bridge, pose: Pose) -> None:
        """Set the alignment of a bridge, and call those who draw by it."""
        self._poses[bridge] = pose
        for listener in tuple(self._listeners.get(bridge, {}).values()):
            listener()

    def on_change(self, bridge: Bridge, listener: Callable[[], object]) -> Removal:
        """Call ``listener`` when the alignment changes, until the removal."""
        listeners = self._listeners.setdefault(bridge, {})
        key = id(listener)
        listeners[key] = listener
        return Removal(lambda: listeners.pop(key, None))


alignments = Alignments()
"""The alignments of all bridges of this process."""


def align_bridge(bridge: Bridge, x: float, y: float, angle: float) -> None:
    """Put the map of a bridge on the common map.

    Robots, grids and markers of that bridge move with it; a robot with its own
    alignment keeps that.

    Args:
        bridge: The connection to the ROS system.
        x: The position of its map's origin on the common map, in metres along x.
        y: The position, in metres along y.
        angle: The rotation of its map in degrees, counter-clockwise.

    Raises:
        ConfigError: If a number is not valid.

    """
    alignments.set(bridge, alignment(x, y, angle))
