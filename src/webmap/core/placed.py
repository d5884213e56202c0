"""Where a robot's module draws: on the robot, or in the world under it."""

import math
from typing import TYPE_CHECKING

from webmap.errors import ConfigError, ProtocolError
from webmap.geometry import Pose
from webmap.scene import svg
from webmap.scene.element import Child
from webmap.scope import Removal, keep

if TYPE_CHECKING:
    from webmap.core.robot import Robot

FRAMES = ("map", "robot")


class Placed:
    """A group of a robot's, in the robot's frame or in that of the map.

    Whichever it is, it is part of the robot's fragment, so that all maps share it and
    CSS finds it below ``.robot``; it ends with the scope that it was made in. A group
    in the map's frame lies under the robot's model, and its module has to call
    :meth:`follow` in ``on_odometry_update``.

    Args:
        robot: The robot.
        *children: What is in the group.
        class_: Its class.
        frame: ``"map"`` if it stays where it is while the robot moves, ``"robot"`` if
            it goes with it.
        x: Metres along x of the frame.
        y: Metres along y of the frame.
        angle: Degrees, counter-clockwise.

    Raises:
        ConfigError: If there is no such frame, or a number is not finite.

    """

    def __init__(
        self,
        robot: "Robot",
        *children: Child,
        class_: str,
        frame: str = "map",
        x: float = 0.0,
        y: float = 0.0,
        angle: float = 0.0,
    ) -> None:
        if frame not in FRAMES:
            raise ConfigError(f"frame is 'map' or 'robot', got {frame!r}")
        if not all(map(math.isfinite, (x, y, angle))):
            raise ConfigError(f"a place must be finite, got {x}, {y}, {angle}")
        self.robot = robot
        self.frame = frame
        self._offset = Pose(x, y, math.radians(angle))
        self.svg = svg.g(*children, class_=class_, pointer_events="none")
        if frame == "map":
            robot.svg.insert(robot.svg.children.index(robot.model), self.svg)
        else:
            robot.svg.append(self.svg)
        self.follow(always=True)
        keep(Removal(self.svg.remove))

    def follow(self, *, always: bool = False) -> None:
        """Stay in place on the map: undo how the robot has moved."""
        place = self._offset
        if self.frame == "map":
            at = self.robot.position
            place = Pose(at.x, at.y, self.robot.yaw).inverse @ place
        elif not always:
            return
        self.svg.set_pose(place.x, place.y, place.yaw)


def rounded(value: float) -> float:
    """Return metres to the millimetre, which is short on the wire."""
    return round(value, 3) + 0.0


def check_finite(points: list[tuple[float, float]], what: str) -> None:
    """Let points pass that can be drawn.

    Raises:
        ProtocolError: If one is not finite; it is named by its number.

    """
    for number, (x, y) in enumerate(points):
        if not (math.isfinite(x) and math.isfinite(y)):
            raise ProtocolError(
                f"{what} must be of finite numbers, got ({x}, {y}) as point {number} "
                f"of {len(points)}"
            )


def thinned(count: int, most: int) -> range | list[int]:
    """Return which of ``count`` things to keep: evenly chosen, and the last one."""
    if count <= most:
        return range(count)
    step = count / most
    return [*(int(i * step) for i in range(most - 1)), count - 1]


def sector(radius: float, half: float) -> str | None:
    """Return the path of a sector about x; None if it has no size.

    Args:
        radius: Metres.
        half: Half its angle, in radians; all round from pi on.

    """
    if radius <= 0 or half < 1e-4:
        return None
    half = min(half, math.pi - 1e-3)
    x, y = radius * math.cos(half), radius * math.sin(half)
    large = int(half > math.pi / 2)
    return (
        f"M0 0L{x:.4f} {-y:.4f}A{radius:.4f} {radius:.4f} 0 {large} 1 {x:.4f} {y:.4f}z"
    )
