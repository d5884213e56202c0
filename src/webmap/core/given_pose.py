"""Poses given by a program or a page."""

import sys
from typing import TYPE_CHECKING, Any, Protocol, TypeGuard

if TYPE_CHECKING:
    from webmap.core.map import Map
    from webmap.core.robot import Robot


class Position(Protocol):
    """Anything with ``x`` and ``y`` in metres."""

    @property
    def x(self) -> float:
        """Metres along x."""

    @property
    def y(self) -> float:
        """Metres along y."""


class Orientation(Protocol):
    """Anything with the components of a quaternion."""

    @property
    def x(self) -> float:
        """The component along x."""

    @property
    def y(self) -> float:
        """The component along y."""

    @property
    def z(self) -> float:
        """The component along z."""

    @property
    def w(self) -> float:
        """The real component."""


def robot_and_pose(
    map: "Map", given: Any
) -> "tuple[Robot, float, float, float] | None":
    """Return the robot, x, y and yaw that a page sent.

    Args:
        map: The map of the page.
        given: A table with ``robot``, its id, ``x`` and ``y`` in metres and ``yaw`` in
            radians. It comes from a page, so it may be anything.

    Returns:
        None if the map has no such robot, or a number is missing.

    """
    if not isinstance(given, dict):
        return None
    robot = map.find_robot(given.get("robot"))
    x, y, yaw = (given.get(name) for name in ("x", "y", "yaw"))
    if robot is None or not (_finite(x) and _finite(y) and _finite(yaw)):
        return None
    return robot, x, y, yaw


def _finite(value: object) -> TypeGuard[float]:
    # An integer may be too large for a float.
    return isinstance(value, int | float) and abs(value) <= sys.float_info.max
