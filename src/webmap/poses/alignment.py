"""Where the map of a robot, or of a whole ROS system, lies on the common map."""

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
"""Metres; no map lies farther off."""

HERE = Pose()
"""The alignment of everything on the common map."""


def alignment(x: float, y: float, angle: float) -> Pose:
    """Return an alignment: the pose of a map's origin on the common map.

    Args:
        x: Metres along the common map's x.
        y: Metres along its y.
        angle: Degrees, counter-clockwise.

    Raises:
        ConfigError: If one of them is no number, or farther than any map.

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
    """Return x and y in metres and the angle in degrees, rounded to what one sees."""
    angle = round(math.degrees(pose.yaw), 2) + 0.0
    return (round(pose.x, 3) + 0.0, round(pose.y, 3) + 0.0, angle)


def toml_line(pose: Pose) -> str:
    """Return the line of a fleet file that keeps an alignment."""
    x, y, angle = numbers(pose)
    return f"alignment = [{x}, {y}, {angle}] # metres, metres, degrees"


class Alignments:
    """What whole ROS systems are aligned by, and who hears of a change."""

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
        """Return where the map of the robots behind a bridge lies."""
        return HERE if bridge is None else self._poses.get(bridge, HERE)

    def stated(self, bridge: Bridge) -> Pose | None:
        """Return where it lies, None if nobody ever said."""
        return self._poses.get(bridge)

    def mark(self, bridge: Bridge) -> str:
        """Return what the page knows the layers of a bridge by."""
        if bridge not in self._marks:
            self._marks[bridge] = f"b{next(_numbers)}"
        return self._marks[bridge]

    def set(self, bridge: Bridge, pose: Pose) -> None:
        """Say where the map of the robots behind a bridge lies."""
        self._poses[bridge] = pose
        for listener in tuple(self._listeners.get(bridge, {}).values()):
            listener()

    def on_change(self, bridge: Bridge, listener: Callable[[], object]) -> Removal:
        """Call ``listener`` whenever that changes, until the removal."""
        listeners = self._listeners.setdefault(bridge, {})
        key = id(listener)
        listeners[key] = listener
        return Removal(lambda: listeners.pop(key, None))


alignments = Alignments()
"""Those of all bridges of this process."""


def align_bridge(bridge: Bridge, x: float, y: float, angle: float) -> None:
    """Lay the map of everything behind a bridge onto the common map.

    Robots, grids and markers of that bridge move there; a robot with an alignment of
    its own keeps that.

    Args:
        bridge: The link to the ROS system.
        x: Where its map's origin is, in metres along the common map's x.
        y: In metres along its y.
        angle: How its map is turned, in degrees, counter-clockwise.

    Raises:
        ConfigError: If a number makes no sense.

    """
    alignments.set(bridge, alignment(x, y, angle))
