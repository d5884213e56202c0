"""A plane that touches the globe: from latitude and longitude to metres and back.

This is the local tangent plane of WGS 84, east and north of a datum, as in
``robot_localization`` and GeographicLib's LocalCartesian. Directions from the datum are
exact. A length on the ground is drawn shorter by its cube divided by six times the
square of the earth's radius: 4 mm at 10 km, 0.5 m at 50 km.
"""

import math

from webmap.base.errors import ConfigError

# The ellipsoid of WGS 84.
EQUATOR = 6378137.0
ECCENTRICITY_2 = 6.69437999014e-3

PLANE_RADIUS = 100_000.0
"""Metres from the datum within which the plane is used; the error there is 4 m."""


class LocalPlane:
    """The plane that touches the globe at a datum.

    Args:
        latitude: Latitude of the datum, in degrees, north positive; not a pole.
        longitude: Longitude of the datum, in degrees, east positive.
        east: The angle from east to x, in degrees, counter-clockwise from above: 90 if
            x points north.

    Raises:
        ConfigError: If the datum is not on the globe, or ``east`` is not finite.

    """

    def __init__(self, latitude: float, longitude: float, east: float = 0.0) -> None:
        if not (abs(latitude) < 90 and abs(longitude) <= 360):
            raise ConfigError(
                "datum is a latitude and a longitude in degrees, got "
                f"({latitude!r}, {longitude!r})"
            )
        if not math.isfinite(east):
            raise ConfigError(f"east must be finite degrees, got {east}")
        self.latitude, self.longitude = latitude, longitude
        lat = math.radians(latitude)
        self._sin, self._cos = math.sin(lat), math.cos(lat)
        turn = -math.radians(east)
        self._turn = math.cos(turn), math.sin(turn)

    def from_globe(self, latitude: float, longitude: float) -> tuple[float, float]:
        """Return x and y of a position, in metres.

        Args:
            latitude: In degrees.
            longitude: In degrees.

        """
        lat, lon = math.radians(latitude), self._turned(longitude)
        away = _radius(math.sin(lat))
        across = away * math.cos(lat)
        up = away * (1 - ECCENTRICITY_2) * math.sin(lat)
        here = _radius(self._sin)
        east = across * math.sin(lon)
        north = self._cos * (up - here * (1 - ECCENTRICITY_2) * self._sin)
        north -= self._sin * (across * math.cos(lon) - here * self._cos)
        cos, sin = self._turn
        return cos * east - sin * north, sin * east + cos * north

    def to_globe(self, x: float, y: float) -> tuple[float, float]:
        """Return latitude and longitude of a position on the plane, in degrees.

        Args:
            x: Metres, within :data:`PLANE_RADIUS` of the datum.
            y: Metres, within :data:`PLANE_RADIUS` of the datum.

        """
        lat, lon = self.latitude, self.longitude
        flat = 1 - ECCENTRICITY_2 * self._sin**2
        metres_lat = math.radians(EQUATOR * (1 - ECCENTRICITY_2) / flat**1.5)
        for _ in range(12):  # each round divides the error by at least 10
            at_x, at_y = self.from_globe(lat, lon)
            dx, dy = x - at_x, y - at_y
            cos, sin = self._turn
            east, north = cos * dx + sin * dy, cos * dy - sin * dx
            away = _radius(math.sin(math.radians(lat)))
            metres_lon = math.radians(away * math.cos(math.radians(lat)))
            lat += north / metres_lat
            lat = max(-89.999, min(89.999, lat))
            lon += east / metres_lon
        return lat, lon

    def _turned(self, longitude: float) -> float:
        return math.radians(math.remainder(longitude - self.longitude, 360))


def _radius(sine: float) -> float:
    """Return the distance from a position straight down to the axis, in metres."""
    return EQUATOR / math.sqrt(1 - ECCENTRICITY_2 * sine * sine)
