"""Groups in which a robot's modules draw: on the robot, or in the world under it."""

import logging
import math
from collections.abc import Callable

from webmap.base.audience import audience
from webmap.base.errors import ConfigError
from webmap.base.geometry import Affine, Pose, Vector3
from webmap.base.scope import Removal, keep
from webmap.core.robot import Robot
from webmap.modules.sighting import Sighting, Sightings
from webmap.poses.frames import delayed_problem
from webmap.poses.placing import ProblemDelay
from webmap.ros.tf import Transform
from webmap.ros.tf.transform import alike
from webmap.scene import svg
from webmap.scene.element import Element
from webmap.scene.node import Child

log = logging.getLogger("webmap.modules")

FRAMES = ("map", "robot")
UNMOVED = Affine()

Draw = Callable[[Transform], object]
"""Draws data in the plane, given the transform from its coordinates to those of a level
frame. There z points up, and heights are above the robot's base, or above the map's
plane."""

SEEN_TILT, SEEN_LIFT = 0.002, 0.005
"""The least tilt in radians and rise in metres by which data is drawn again."""


class Placed:
    """A group of a robot whose data stays where it was measured.

    It is part of the robot's fragment, so all maps share it, and CSS selects it below
    ``.robot``. It ends with the scope in which it was created.

    Data in the robot's own frame moves with the robot until a message has a stamp: see
    :meth:`stand_in`. From then on the data stays on the map at the robot's pose at that
    stamp, so that a wall does not turn with the robot that sees it. A group in the
    map's frame is drawn under the robot's model.

    The group itself only turns in the plane. For data that is tilted, upside down or on
    its side, pass a function to :meth:`stand_in` that draws it as seen from above.

    Args:
        robot: The robot.
        *children: The children of the group.
        class_: Its CSS class.
        frame: ``"map"`` if its coordinates are the map's, ``"robot"`` if they are the
            robot's.
        x: Metres along x of the frame.
        y: Metres along y of the frame.
        angle: Degrees, counter-clockwise.

    Raises:
        ConfigError: If there is no such frame, or a number is not finite.

    """

    def __init__(
        self,
        robot: Robot,
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
        self._class = class_
        mount = Pose(x, y, math.radians(angle))
        self._sightings = Sightings(
            robot.pose_source, frame, mount if mount != Pose() else None
        )
        self._seen: tuple[str, float] | None = None
        self._looked_up: tuple[str, float, Sighting] | None = None
        """The pose that :meth:`moved_within` needed, for the same message."""
        self._draw: Draw | None = None
        self._drawn: Transform | None = None
        self._offset = Affine.of_pose(mount)
        """The transform from the group's coordinates to the robot's own map, or to the
        robot; or to the common map before the first message."""
        self._on_robot = frame == "robot"
        self._settled = True
        self._upright: dict[Element, tuple[float, float]] = {}
        self._trouble = ""
        self._problem_delay = ProblemDelay()
        self.svg = svg.g(*children, class_=class_, pointer_events="none")
        if frame == "map":
            robot.svg.insert(robot.svg.children.index(robot.model), self.svg)
        else:
            robot.svg.append(self.svg)
        self._put()
        self._pose_removal = robot.pose_source.join(self._on_poses)
        keep(Removal(self._end))

    def stand_in(self, frame_id: str, stamp: float, draw: Draw | None = None) -> None:
        """Set the frame of the coordinates, as it was at the stamp of a message.

        The frames of ``set_tf`` give the pose of that frame at the stamp, or the
        robot's poses if there are no frames. If the newest of them is older than the
        stamp, the motion is extrapolated, and corrected when newer ones arrive.

        Without frames, a sensor is placed by the options of its module, or at the
        robot's origin. If a frame is unknown, its last pose is used, or the robot's
        frame or the map's, and the robot shows a problem.

        Args:
            frame_id: The frame of the message; empty if it has none.
            stamp: The time of measurement in seconds of the robot's clock; 0 if there
                is none.
            draw: Draws the data as seen from above. It is called at once, and again if
                the tilt of the frame changes. Without it the group must lie in the
                plane of the frame.

        """
        known, self._looked_up = self._looked_up, None
        if known is not None and known[:2] == (frame_id, stamp):
            found = known[2]
        else:
            found = self._sightings.look(frame_id, stamp)
        before = (self._seen, self._draw, self._drawn)
        self._seen = (frame_id, stamp)
        self._draw, self._drawn = draw, None
        try:
            self._place(found)
        except BaseException:
            self._seen, self._draw, self._drawn = before
            raise

    def moved_within(self, frame_id: str, stamp: float, seconds: float) -> Pose:
        """Return how a sensor moves in a time, in its own plane at the beginning.

        Args:
            frame_id: The sensor's frame.
            stamp: The beginning, in seconds of the robot's clock; 0 if there is none.
            seconds: The duration; at most 0.5 s are extrapolated.

        """
        if not stamp:
            return Pose()
        then = self._sightings.look(frame_id, stamp)
        self._looked_up = (frame_id, stamp, then)
        later = self._sightings.look(frame_id, stamp + seconds)
        if then.on_robot or later.on_robot:
            return Pose()
        return (then.offset.inverse @ later.offset).planar

    def keep_upright(self, element: Element, x: float, y: float) -> None:
        """Keep an element of the group from turning with it.

        Args:
            element: The element; its y then points down and its units are centimetres.
            x: Its distance from the group's origin, in metres along the map's x.
            y: Its distance, in metres along the map's y.

        """
        self._upright[element] = (x, y)
        self._put()

    def _on_poses(self) -> None:
        if self._settled:
            if audience.present and (not self._on_robot or self._upright):
                self._put()
            return
        try:
            self._settle()
        except Exception as error:  # the other listeners must run too
            self._settled = True
            self._trouble = "failed"  # so that the next successful drawing clears it
            log.exception("%s: drawing failed", self._class)
            text = f"drawing failed: {type(error).__name__}: {error}"
            self.robot.set_problem(self, f"{self._class}: {text}")

    def _settle(self) -> None:
        """Determine the current pose of the group as well as possible."""
        if self._seen is not None:
            self._place(self._sightings.look(*self._seen))

    def _place(self, found: Sighting) -> None:
        """Draw the data and put the group at a pose."""
        if self._draw is None:
            offset = found.offset.from_above
        else:
            pose, tilt = found.offset.heading_and_tilt
            lift = Vector3(0.0, 0.0, tilt.translation.z - found.ground)
            self._tilt(self._draw, Transform(lift, tilt.rotation))
            offset = Affine.of_pose(pose)
        # Only now, since drawing may fail: the earlier drawing then stays in place.
        self._offset, self._on_robot = offset, found.on_robot
        self._settled = found.settled
        self._show_trouble(found)
        self._put()

    def _tilt(self, draw: Draw, tilt: Transform) -> None:
        """Draw again if the tilt changed visibly."""
        if self._drawn is None or not alike(self._drawn, tilt, SEEN_LIFT, SEEN_TILT):
            self._drawn = tilt
            draw(tilt)

    def _put(self) -> None:
        place = self._offset
        if not self._on_robot:
            if self._seen is not None:
                place = self.robot.pose_source.common_from_own @ place
            at, heading = self.robot.position, self.robot.orientation.yaw
            if place == UNMOVED and not self._upright:  # a trail, at each pose
                cos, sin = math.cos(heading), math.sin(heading)
                x, y = cos * at.x + sin * at.y, cos * at.y - sin * at.x
                self.svg.set_pose(0.0 - x, 0.0 - y, 0.0 - heading)
                return
            place = Affine.into_pose(Pose(at.x, at.y, heading)) @ place
        put(self.svg, place)
        for element, (x, y) in self._upright.items():
            turn = Affine.rotation(-self.robot.yaw - math.atan2(place.b, place.a))
            element.set_matrix(turn @ Affine(0.01, 0, 0, -0.01, x, y))

    def _show_trouble(self, found: Sighting) -> None:
        """Show a problem of the pose once; clear it when it ends."""
        trouble = delayed_problem(
            self._problem_delay, found.trouble, self.robot.pose_source.frames
        )
        if trouble == self._trouble:
            return
        self._trouble = trouble
        if trouble:
            self.robot.set_problem(self, f"{self._class}: {found.text}")
        else:
            self.robot.clear_problem(self)

    def _end(self) -> None:
        self._pose_removal.remove()
        self.svg.remove()
        self.robot.clear_problem(self)


def put(element: Element, place: Affine) -> None:
    """Place an element: by a pose, which is a shorter message, if possible."""
    if abs(place.a - place.d) < 1e-9 and abs(place.b + place.c) < 1e-9:
        element.set_pose(place.e, place.f, math.atan2(place.b, place.a))
    else:
        element.set_matrix(place)
