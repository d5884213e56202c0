"""A robot and a pose for it, as the page's half of a module tells of them."""

import sys
from typing import TYPE_CHECKING, Any, TypeGuard

if TYPE_CHECKING:
    from webmap.core.map import Map
    from webmap.core.robot import Robot


def robot_and_pose(map: "Map", said: Any) -> "tuple[Robot, float, float, float] | None":
    """Return which robot of a map a page means, and x, y and yaw.

    Args:
        map: The map that the page shows.
        said: A table with ``robot``, its id, ``x`` and ``y`` in metres and ``yaw`` in
            radians; what comes from a page may be anything else.

    Returns:
        None if the map has no such robot, or a number is missing.

    """
    if not isinstance(said, dict):
        return None
    robot = map.find_robot(said.get("robot"))
    x, y, yaw = (said.get(name) for name in ("x", "y", "yaw"))
    if robot is None or not (_finite(x) and _finite(y) and _finite(yaw)):
        return None
    return robot, x, y, yaw


def _finite(value: object) -> TypeGuard[float]:
    # A whole number may have more digits than any float has.
    return isinstance(value, int | float) and abs(value) <= sys.float_info.max
