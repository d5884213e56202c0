"""A typed view of where satellites have something."""

import math

import msgspec

from webmap.errors import ProtocolError
from webmap.ros.messages import Stamped


class NavSatStatusMsg(msgspec.Struct, frozen=True):
    """``sensor_msgs/NavSatStatus``."""

    status: int = -1
    """-1 no fix, 0 a fix, above a fix with corrections."""


class NavSatFixMsg(Stamped, frozen=True, kw_only=True):
    """``sensor_msgs/NavSatFix``, and what a ``GPSFix`` says of the same."""

    latitude: float
    """Degrees, north positive."""

    longitude: float
    """Degrees, east positive."""

    status: NavSatStatusMsg = NavSatStatusMsg()
    position_covariance: list[float] = msgspec.field(default_factory=list)
    """Nine numbers in square metres: east, north and up."""

    position_covariance_type: int = 0
    """0 if nobody knows it."""

    @property
    def place(self) -> tuple[float, float]:
        """Latitude and longitude, in degrees.

        Raises:
            ProtocolError: If they are on no globe.

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
        """The standard deviation in the plane, in metres; None if it is not known."""
        c = self.position_covariance
        if self.position_covariance_type == 0 or len(c) != 9:
            return None
        variance = max(c[0], c[4])
        known = math.isfinite(c[0] + c[4]) and variance >= 0
        return math.sqrt(variance) if known else None
