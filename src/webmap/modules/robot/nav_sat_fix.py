"""Where satellites have a robot."""

import math
from typing import TYPE_CHECKING

from webmap.core.placed import Placed
from webmap.core.refusals import refusing
from webmap.errors import ConfigError
from webmap.ros.bridge import Bridge
from webmap.ros.messages_fix import NavSatFixMsg
from webmap.scene import svg

if TYPE_CHECKING:
    from webmap.core.robot import Robot

# The ellipsoid of WGS 84.
EQUATOR = 6378137.0
ECCENTRICITY_2 = 6.69437999014e-3


class NavSatFix:
    """Draws a ``sensor_msgs/NavSatFix`` as a cross with a circle of its doubt.

    A fix is put on the map as on a plane that touches the globe at a datum, which is
    good to a metre within some kilometres. Without a fix the last one stays and ages,
    with the class ``lost``.

    Style it by CSS: ``.navsatfix > .cross``, ``.navsatfix > .doubt`` and
    ``.navsatfix.lost``.

    Args:
        robot: The robot that carries the receiver.
        bridge: The link to the ROS system that has the topic.
        topic: The topic.
        datum: Latitude and longitude of the map's origin, in degrees. If not given,
            the first fix is taken to be where the robot is on the map then.
        east: How far the map's x is turned from east, in degrees, counter-clockwise
            from above.
        throttle: The least time between two fixes, in milliseconds.
        age_limit: Seconds after which a fix is drawn as old.

    Raises:
        ConfigError: If the datum is on no globe, or ``east`` is not finite.

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
    ) -> None:
        if datum is not None and not (
            len(datum) == 2 and abs(datum[0]) < 90 and abs(datum[1]) <= 360
        ):
            raise ConfigError(
                f"datum is a latitude and a longitude in degrees, got {datum!r}"
            )
        if not math.isfinite(east):
            raise ConfigError(f"east must be finite degrees, got {east}")
        self.robot = robot
        self.datum = datum
        self.age_limit = age_limit
        self.position: tuple[float, float] | None = None
        """The last fix on the map, in metres."""
        self._origin = (0.0, 0.0)
        self._turn = -math.radians(east)
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
        bridge.subscribe(
            topic,
            refusing(robot, topic, self.on_fix),
            "sensor_msgs/NavSatFix",
            throttle=throttle,
            decode=NavSatFixMsg,
        )

    def on_fix(self, fix: NavSatFixMsg) -> None:
        """Draw a fix in place of the one before.

        Raises:
            ProtocolError: If it claims to be one and is on no globe.

        """
        lost = fix.status.status < 0
        if not lost:
            self._go(fix)
        self.svg.classes.toggle("lost", lost)

    def on_odometry_update(self) -> None:
        """Keep the fix where it is while the robot goes along."""
        self._placed.follow()

    def _go(self, fix: NavSatFixMsg) -> None:
        place = fix.place
        if self.datum is None:
            at = self.robot.position
            self.datum, self._origin = place, (at.x, at.y)
        east, north = metres_from(self.datum, place)
        cos, sin = math.cos(self._turn), math.sin(self._turn)
        x = self._origin[0] + cos * east - sin * north
        y = self._origin[1] + sin * east + cos * north
        self.position = (x, y)
        for element in (self.doubt, self.cross):
            element.set_pose(x, y, 0.0)
        self.doubt.set(r=fix.deviation or 0.0)
        self.cross.unset("visibility")
        self.svg.set_age(0.0, limit=self.age_limit)


def metres_from(
    datum: tuple[float, float], place: tuple[float, float]
) -> tuple[float, float]:
    """Return how far a place is east and north of a datum, in metres.

    Args:
        datum: Latitude and longitude, in degrees, on no pole.
        place: Likewise.

    """
    lat = math.radians(datum[0])
    flat = 1 - ECCENTRICITY_2 * math.sin(lat) ** 2
    across = EQUATOR / math.sqrt(flat)
    along = EQUATOR * (1 - ECCENTRICITY_2) / flat**1.5
    turn = math.remainder(place[1] - datum[1], 360)
    return (
        math.radians(turn) * across * math.cos(lat),
        math.radians(place[0] - datum[0]) * along,
    )
