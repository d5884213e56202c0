"""Positions by satellites."""

import math
import time

import msgspec

from webmap.base.errors import ConfigError, ProtocolError
from webmap.base.geometry import FARTHEST
from webmap.base.local_plane import LocalPlane
from webmap.modules.declaration import TopicKind, layer
from webmap.modules.robot_layer import RobotLayer
from webmap.ros.messages import Stamped
from webmap.scene import svg


class NavSatStatusMsg(msgspec.Struct, frozen=True):
    """``sensor_msgs/NavSatStatus``."""

    status: int = -1
    """-1 no fix, 0 a fix, greater for a fix with corrections."""


class NavSatFixMsg(Stamped, frozen=True, kw_only=True):
    """``sensor_msgs/NavSatFix``, and the same fields of a ``GPSFix``."""

    latitude: float
    """Degrees, north positive."""

    longitude: float
    """Degrees, east positive."""

    status: NavSatStatusMsg = NavSatStatusMsg()
    position_covariance: list[float] = msgspec.field(default_factory=list)
    """Nine numbers in square metres: east, north and up."""

    position_covariance_type: int = 0
    """0 if unknown."""

    @property
    def place(self) -> tuple[float, float]:
        """Latitude and longitude, in degrees.

        Raises:
            ProtocolError: If they are outside their ranges.
        """
        lat, lon = self.latitude, self.longitude
        if not (-90 <= lat <= 90 and -360 <= lon <= 360):
            raise ProtocolError(
                "a fix has a latitude of -90 to 90 degrees and a longitude, got "
                f"{lat} and {lon}"
            )
        return lat, lon

    @property
    def deviation(self) -> float | None:
        """The standard deviation in the plane, in metres; None if unknown."""
        c = self.position_covariance
        if self.position_covariance_type == 0 or len(c) != 9:
            return None
        variance = max(c[0], c[4])
        known = math.isfinite(c[0] + c[4]) and variance >= 0
        return math.sqrt(variance) if known else None


@layer(
    "sensor_msgs/NavSatFix",
    "gps_msgs/GPSFix",
    "gps_common/GPSFix",
    view=NavSatFixMsg,
    kinds=[
        TopicKind("fix", {r"/fix\Z": "the usual name", "": "its type alone"}, most=1),
    ],
    switch="Satellite fixes",
    rank=130,
)
class NavSatFix(RobotLayer):
    """A cross at a robot's satellite position, with a circle of one standard deviation.

    A fix is projected to a plane that touches the globe at a datum: lengths are
    accurate to 4 mm at 10 km from the datum, and to 0.5 m at 50 km. ``TileLayer`` with
    the same datum uses the same projection. Without a fix the last fix stays and ages,
    with the class ``lost``.

    Style it by CSS: ``.navsatfix > .cross``, ``.navsatfix > .covariance`` and
    ``.navsatfix.lost``.
    """

    only_draws = True

    topic: str = "/fix"

    datum: tuple[float, float] | None = None
    """Latitude and longitude of the map's origin, in degrees. If not given, the first
    fix is aligned with the robot's position on the map at that time; fixes before the
    robot has a pose are not drawn. For a robot with frames but without a map, and with
    ``quiet`` set for this, the odometry position is used until there is a map.
    """

    east: float = 0.0
    """Rotation of the map's x from east, in degrees, counter-clockwise from above."""

    throttle: int = 500
    age_limit: float = 5.0

    type: str = "sensor_msgs/NavSatFix"
    """``sensor_msgs/NavSatFix``, or a ``GPSFix`` of ``gps_msgs`` or ``gps_common``,
    which has the same fields.
    """

    def build(self) -> None:
        """Make the cross and the circle.

        Raises:
            ConfigError: If the datum is outside its ranges, or ``east`` is not finite.
        """
        if self.datum is not None and len(self.datum) != 2:
            raise ConfigError(
                f"datum is a latitude and a longitude in degrees, got {self.datum!r}"
            )
        # All fixes share one switch: a robot has one position.
        self.svg.unset("data-layer")
        self._plane = LocalPlane(*(self.datum or (0.0, 0.0)), self.east)
        self.position: tuple[float, float] | None = None
        """The last fix on the map, in metres."""
        self._origin = (0.0, 0.0)
        self._waiting = self.datum is None
        self.covariance = self.add(
            svg.circle(class_="covariance", fill="#3b82c4", fill_opacity=0.2, r=0)
        )
        self.cross = self.add(
            svg.path(
                class_="cross",
                d="M-0.15 0H0.15M0 -0.15V0.15",
                stroke="#1f5f99",
                stroke_width=2,
                vector_effect="non-scaling-stroke",
                visibility="hidden",
            )
        )

    def take(self, message: NavSatFixMsg) -> None:
        """Draw a fix in place of the last one; it is on the globe, not in a frame.

        Raises:
            ProtocolError: If a message with a fix has coordinates outside their ranges.
        """
        lost = message.status.status < 0
        if not lost:
            _ = message.place
        self.svg.classes.toggle("lost", lost)
        if not lost:
            self._go(message)

    def _go(self, fix: NavSatFixMsg) -> None:
        place = fix.place
        if self._waiting:
            self._anchor(place)
        if self.datum is None:
            return
        x, y = self._plane.from_globe(*place)
        x, y = x + self._origin[0], y + self._origin[1]
        self.position = (x, y)
        for element in (self.covariance, self.cross):
            element.set_pose(x, y, 0.0)
        deviation = fix.deviation or 0.0
        self.covariance.set(r=deviation if deviation <= FARTHEST else 0.0)
        self.cross.unset("visibility")
        self.svg.set_age(self.bridge.lag, limit=self.age_limit)
        if deviation > FARTHEST:
            self.complain(
                f"the standard deviation of a fix must be at most {FARTHEST:g} m, got "
                f"{deviation:g} m; its circle is not drawn"
            )

    def _anchor(self, place: tuple[float, float]) -> None:
        """Align a position on the globe with the robot's, once the robot has a pose."""
        if not self.robot.valid:
            return
        on_map = self._is_on_map()
        if on_map is None:
            return
        # A position by odometry alone is used until the position on the map is known.
        if on_map or self.datum is None:
            at = self.robot.position
            self.datum, self._origin = place, (at.x, at.y)
            self._plane = LocalPlane(*place, self.east)
        self._waiting = not on_map

    def _is_on_map(self) -> bool | None:
        """Return whether the robot's pose is on the map; None if it may become so."""
        tf, pose = self.robot.tf, self.robot.pose_source.newest
        if tf is None or pose is None or pose.frame_id in ("", tf["map_frame"]):
            return True
        # Many robots have frames but no map; this is no error if ``quiet`` is set.
        frames = self.robot.pose_source.frames
        missing = frames is not None and time.monotonic() >= frames.complete_from
        return False if tf["quiet"] and missing else None
