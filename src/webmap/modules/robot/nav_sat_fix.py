"""Where satellites have a robot."""

import time
from typing import TYPE_CHECKING

from webmap.core.frames import frames_of
from webmap.core.local_plane import LocalPlane
from webmap.core.placed import Placed
from webmap.core.refusals import refusing
from webmap.errors import ConfigError, ProtocolError
from webmap.geometry.reach import FARTHEST
from webmap.ros.bridge import Bridge
from webmap.ros.messages_fix import NavSatFixMsg
from webmap.ros.names import split_type
from webmap.scene import svg

if TYPE_CHECKING:
    from webmap.core.robot import Robot

TYPES = ("sensor_msgs/NavSatFix", "gps_msgs/GPSFix", "gps_common/GPSFix")
"""What tells of a fix."""


class NavSatFix:
    """Draws a ``sensor_msgs/NavSatFix`` as a cross with a circle of its doubt.

    A ``GPSFix`` of ``gps_common`` or ``gps_msgs`` says the same in the same words.

    A fix is put on the map as on a plane that touches the globe at a datum: lengths are
    right to 4 mm at 10 km from there, and to 0.5 m at 50 km. ``TileLayer`` with the
    same datum puts its tiles there too. Without a fix the last one stays and ages, with
    the class ``lost``.

    Style it by CSS: ``.navsatfix > .cross``, ``.navsatfix > .doubt`` and
    ``.navsatfix.lost``.

    Args:
        robot: The robot that carries the receiver.
        bridge: The link to the ROS system that has the topic.
        topic: The topic.
        datum: Latitude and longitude of the map's origin, in degrees. If not given,
            the first fix is taken to be where the robot is on the map then; fixes
            before it has a place there are not drawn.
        east: How far the map's x is turned from east, in degrees, counter-clockwise
            from above.
        throttle: The least time between two fixes, in milliseconds.
        age_limit: Seconds after which a fix is drawn as old.
        type: Of the messages: ``sensor_msgs/NavSatFix`` or a ``GPSFix``.

    Raises:
        ConfigError: If the datum is on no globe, ``east`` is not finite, or messages of
            the type tell of no fix.

    """

    def __init__(
        self,
        robot: "Robot",
        bridge: Bridge,
        topic: str = "/fix",
        *,
        datum: tuple[float, float] | None = None,
        east: float = 0.0,
        throttle: int = 500,
        age_limit: float = 5.0,
        type: str = "sensor_msgs/NavSatFix",
    ) -> None:
        if str(split_type(type)) not in TYPES:
            raise ConfigError(f"type is one of {', '.join(TYPES)}, got {type!r}")
        if datum is not None and len(datum) != 2:
            raise ConfigError(
                f"datum is a latitude and a longitude in degrees, got {datum!r}"
            )
        self._east = east
        self._plane = LocalPlane(*(datum or (0.0, 0.0)), east)
        self.robot = robot
        self.topic = topic
        self.datum = datum
        self.age_limit = age_limit
        self.position: tuple[float, float] | None = None
        """The last fix on the map, in metres."""
        self._origin = (0.0, 0.0)
        self._waiting = datum is None
        self.doubt = svg.circle(class_="doubt", fill="#3b82c4", fill_opacity=0.2, r=0)
        self.cross = svg.path(
            class_="cross",
            d="M-0.15 0H0.15M0 -0.15V0.15",
            stroke="#1f5f99",
            stroke_width=2,
            vector_effect="non-scaling-stroke",
            visibility="hidden",
        )
        self._placed = Placed(robot, self.doubt, self.cross, class_="navsatfix")
        self.svg = self._placed.svg
        self._bridge = bridge
        bridge.subscribe(
            topic,
            refusing(robot, topic, self.on_fix),
            type,
            throttle=throttle,
            decode=NavSatFixMsg,
        )

    def on_fix(self, fix: NavSatFixMsg) -> None:
        """Draw a fix in place of the one before.

        Raises:
            ProtocolError: If it claims to be one and is on no globe; or if its doubt
                is larger than that, but the fix is drawn then.

        """
        lost = fix.status.status < 0
        if not lost:
            _ = fix.place
        self.svg.classes.toggle("lost", lost)
        if not lost:
            self._go(fix)

    def on_odometry_update(self) -> None:
        """Keep the fix where it is while the robot goes along."""
        self._placed.follow()

    def _go(self, fix: NavSatFixMsg) -> None:
        place = fix.place
        if self._waiting:
            self._anchor(place)
        if self.datum is None:
            return
        x, y = self._plane.from_globe(*place)
        x, y = x + self._origin[0], y + self._origin[1]
        self.position = (x, y)
        for element in (self.doubt, self.cross):
            element.set_pose(x, y, 0.0)
        doubt = fix.deviation or 0.0
        self.doubt.set(r=doubt if doubt <= FARTHEST else 0.0)
        self.cross.unset("visibility")
        self.svg.set_age(self._bridge.lag, limit=self.age_limit)
        if doubt > FARTHEST:
            raise ProtocolError(
                f"a fix has a doubt of {FARTHEST:g} m at the most, got {doubt:g} m, "
                "which is not drawn"
            )

    def _anchor(self, place: tuple[float, float]) -> None:
        """Take a place on the globe for the robot's, as soon as that has one."""
        if not self.robot.valid:
            return
        on_map = self._is_on_map()
        if on_map is None:
            return
        # Where it is by odometry alone is good until it is known on the map.
        if on_map or self.datum is None:
            at = self.robot.position
            self.datum, self._origin = place, (at.x, at.y)
            self._plane = LocalPlane(*place, self._east)
        self._waiting = not on_map

    def _is_on_map(self) -> bool | None:
        """Return whether the robot's pose is one of the map; None if it may yet be."""
        tf, pose = self.robot.tf, self.robot.whereabouts.newest
        if tf is None or pose is None or pose.frame_id in ("", tf["map_frame"]):
            return True
        # Many robots have frames and no map, and that is no mistake if it is quiet.
        missing = (
            time.monotonic() >= frames_of(tf["bridge"], tf["namespace"]).complete_from
        )
        return False if tf["quiet"] and missing else None
