"""Where a robot's module draws: on the robot, or in the world under it."""

import logging
import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from webmap.base.errors import ConfigError
from webmap.base.geometry import Affine, Pose, Vector3
from webmap.base.scope import Removal, keep
from webmap.modules.sighting import Sighting, Sightings
from webmap.poses.frames import lasting
from webmap.poses.lasting import Lasting
from webmap.ros.tf import Transform
from webmap.ros.tf.transform import alike
from webmap.scene import svg
from webmap.scene.element import Child, Element

if TYPE_CHECKING:
    from webmap.core.robot import Robot

log = logging.getLogger("webmap.modules")

FRAMES = ("map", "robot")

Draw = Callable[[Transform], object]
"""Draws data in the plane, given what takes its coordinates to those of a level frame:
z points up there, and heights begin at the robot's base, or at the map's plane."""

SEEN_TILT, SEEN_LIFT = 0.002, 0.005
"""Radians and metres by which data has to tilt and rise to be drawn anew."""


class Placed:
    """A group of a robot's whose data stays where it was measured.

    It is part of the robot's fragment, so that all maps share it and CSS finds it below
    ``.robot``; it ends with the scope that it was made in.

    Data of the robot's own frame goes with the robot until a message says when it was
    measured: see :meth:`stand_in`. From then on it stays on the map where the robot was
    at that time, so that a wall does not turn along with who looks at it.

    A group in the map's frame lies under the robot's model.

    The group itself only turns in the plane. For data that is tilted, upside down or on
    its side, pass a function to :meth:`stand_in` that draws it as seen from above.

    Args:
        robot: The robot.
        *children: What is in the group.
        class_: Its class.
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
        self._class = class_
        mount = Pose(x, y, math.radians(angle))
        self._sightings = Sightings(
            robot.whereabouts, frame, mount if mount != Pose() else None
        )
        self._seen: tuple[str, float] | None = None
        self._draw: Draw | None = None
        self._drawn: Transform | None = None
        self._offset = Affine.of_pose(mount)
        """What takes the group's coordinates to those of the robot's own map, or to the
        robot's; or to the common map if no message was ever taken."""
        self._on_robot = frame == "robot"
        self._settled = True
        self._upright: dict[Element, tuple[float, float]] = {}
        self._trouble = ""
        self._lasting = Lasting()
        self.svg = svg.g(*children, class_=class_, pointer_events="none")
        if frame == "map":
            robot.svg.insert(robot.svg.children.index(robot.model), self.svg)
        else:
            robot.svg.append(self.svg)
        self._put()
        self._hears = robot.whereabouts.join(self._news)
        keep(Removal(self._end))

    def stand_in(self, frame_id: str, stamp: float, draw: Draw | None = None) -> None:
        """Take coordinates to be in the frame that a message names, as it was then.

        The frames that the robot was given with ``set_tf`` say where that frame was at
        the stamp, or the robot's poses if there are none. If the newest of them is
        older than the stamp, the motion is extrapolated, and corrected when newer ones
        come.

        Without frames, a sensor is where the options of its module place it, or at the
        robot's origin. If a frame is unknown, its last place is used, or the robot's
        frame or the map's, and the robot shows a problem.

        Args:
            frame_id: The frame of the message; empty if it does not say.
            stamp: When it was measured, in seconds of the robot's clock; 0 if not said.
            draw: Draws the data as it looks from above. It is called at once, and again
                when it turns out that the frame is tilted otherwise. Without it the
                group has to lie in the plane of the frame.

        """
        before = (self._seen, self._draw, self._drawn)
        self._seen = (frame_id, stamp)
        self._draw, self._drawn = draw, None
        try:
            self._settle()
        except BaseException:
            self._seen, self._draw, self._drawn = before
            raise

    def moved_within(self, frame_id: str, stamp: float, seconds: float) -> Pose:
        """Return where a sensor gets in a time, in its own plane as it was before.

        Args:
            frame_id: The sensor's frame.
            stamp: When the time begins, in seconds of the robot's clock; 0 if not said.
            seconds: How long; 0.5 s at the most are looked ahead.

        """
        if not stamp:
            return Pose()
        then, later = (
            self._sightings.look(frame_id, stamp + after) for after in (0.0, seconds)
        )
        if then.on_robot or later.on_robot:
            return Pose()
        return (then.offset.inverse @ later.offset).planar

    def keep_upright(self, element: Element, x: float, y: float) -> None:
        """Keep an element of the group from turning with it.

        Args:
            element: Its y then points down and its units are centimetres.
            x: Where it is from the group's origin, in metres along the map's x.
            y: In metres along the map's y.

        """
        self._upright[element] = (x, y)
        self._put()

    def _news(self) -> None:
        if self._settled:
            if not self._on_robot or self._upright:
                self._put()
            return
        try:
            self._settle()
        except Exception as error:  # others hear of the news too
            self._settled = True
            self._trouble = "failed"  # so that the next drawing that works clears it
            log.exception("%s: drawing failed", self._class)
            words = f"drawing failed: {type(error).__name__}: {error}"
            self.robot.set_problem(self, f"{self._class}: {words}")

    def _settle(self) -> None:
        """Find out where the group is, as well as it can be known by now."""
        if self._seen is None:
            return
        found = self._sightings.look(*self._seen)
        if self._draw is None:
            offset = found.offset.from_above
        else:
            pose, tilt = found.offset.heading_and_tilt
            lift = Vector3(0.0, 0.0, tilt.translation.z - found.ground)
            self._tilt(self._draw, replace(tilt, translation=lift))
            offset = Affine.of_pose(pose)
        # Only now, since drawing may fail: what was drawn before then stays in place.
        self._offset, self._on_robot = offset, found.on_robot
        self._settled = found.settled
        self._say(found)
        self._put()

    def _tilt(self, draw: Draw, tilt: Transform) -> None:
        """Draw again what looks otherwise now."""
        if self._drawn is None or not alike(self._drawn, tilt, SEEN_LIFT, SEEN_TILT):
            self._drawn = tilt
            draw(tilt)

    def _put(self) -> None:
        place = self._offset
        if not self._on_robot:
            at = self.robot.position
            own = Affine.of_pose(Pose(at.x, at.y, self.robot.yaw))
            if self._seen is not None:
                place = self.robot.whereabouts.common_from_own @ place
            place = own.inverse @ place
        put(self.svg, place)
        for element, (x, y) in self._upright.items():
            turn = Affine.rotation(-self.robot.yaw - math.atan2(place.b, place.a))
            element.set_matrix(turn @ Affine(0.01, 0, 0, -0.01, x, y))

    def _say(self, found: Sighting) -> None:
        """Show what is wrong with the place once; clear it when that is over."""
        trouble = lasting(self._lasting, found.trouble, self.robot.whereabouts.frames)
        if trouble == self._trouble:
            return
        self._trouble = trouble
        if trouble:
            self.robot.set_problem(self, f"{self._class}: {found.words}")
        else:
            self.robot.clear_problem(self)

    def _end(self) -> None:
        self._hears.remove()
        self.svg.remove()
        self.robot.clear_problem(self)


def put(element: Element, place: Affine) -> None:
    """Place an element: by a pose, which is short on the wire, if it is one."""
    if abs(place.a - place.d) < 1e-9 and abs(place.b + place.c) < 1e-9:
        element.set_pose(place.e, place.f, math.atan2(place.b, place.a))
    else:
        element.set_matrix(place)
