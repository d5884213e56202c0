"""Where a robot's module draws: on the robot, or in the world under it."""

import math
from typing import TYPE_CHECKING

from webmap.core.frames import frames_of
from webmap.errors import ConfigError, ProtocolError
from webmap.geometry import Pose
from webmap.scene import svg
from webmap.scene.element import Child
from webmap.scope import Removal, keep
from webmap.tf import Buffer, NotKnownThen, TransformError

if TYPE_CHECKING:
    from webmap.core.robot import Robot

FRAMES = ("map", "robot")


class Placed:
    """A group of a robot's, in the robot's frame or in that of the map.

    Whichever it is, it is part of the robot's fragment, so that all maps share it and
    CSS finds it below ``.robot``; it ends with the scope that it was made in. A group
    in the map's frame lies under the robot's model, and its module has to call
    :meth:`follow` in ``on_odometry_update``.

    A message whose frame is another is taken there by the frames that the robot was
    given with ``set_tf``: see :meth:`stand_in`. Without them its numbers are taken to
    be in the group's frame.

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
        self._mounted = self._offset != Pose()
        self._known: dict[str, Pose] = {}
        self._class = class_
        self.svg = svg.g(*children, class_=class_, pointer_events="none")
        if frame == "map":
            robot.svg.insert(robot.svg.children.index(robot.model), self.svg)
        else:
            robot.svg.append(self.svg)
        self.follow(always=True)
        keep(Removal(self._end))

    def stand_in(self, frame_id: str, stamp: float) -> None:
        """Take the group's own coordinates to be in a frame that a message names.

        It is looked up as it was at the stamp. Without frames, or where the module was
        told a place on the robot, nothing changes; a frame that nobody tells of is
        taken to be where it was last, or the group's own, and that is said.

        Args:
            frame_id: The frame of the message; empty if it does not say.
            stamp: When it was measured, in seconds of the robot's clock; 0 if not said.

        """
        tf = self.robot.tf
        if tf is None or self._mounted or not frame_id:
            return
        buffer = frames_of(tf["bridge"], tf["namespace"]).buffer
        source = buffer.name(frame_id, tf["namespace"])
        target = tf["map_frame"] if self.frame == "map" else tf["base_frame"]
        try:
            pose = (
                Pose() if source == target else _lookup(buffer, target, source, stamp)
            )
            self._known[source] = pose
            self.robot.clear_problem(self)
        except TransformError as error:
            pose = self._known.get(source, Pose())
            if not tf["quiet"]:
                self.robot.set_problem(
                    self, f"{self._class}: it is not known where {source!r} is: {error}"
                )
        self._offset = pose
        self.follow(always=True)

    def _end(self) -> None:
        self.svg.remove()
        self.robot.clear_problem(self)

    def follow(self, *, always: bool = False) -> None:
        """Stay in place on the map: undo how the robot has moved."""
        place = self._offset
        if self.frame == "map":
            at = self.robot.position
            place = Pose(at.x, at.y, self.robot.yaw).inverse @ place
        elif not always:
            return
        self.svg.set_pose(place.x, place.y, place.yaw)


def _lookup(buffer: Buffer, target: str, source: str, stamp: float) -> Pose:
    """Return the pose of a frame in another, at a time or at the newest one known."""
    if stamp:
        try:
            return buffer.lookup(target, source, stamp).planar
        except NotKnownThen:
            pass
    return buffer.lookup(target, source).planar


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
