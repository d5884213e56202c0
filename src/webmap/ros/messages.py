"""Typed views of ROS messages: the fields that WebMap needs, in either dialect.

A view names a few fields of a message; a decoder skips the rest. Fields that
distinguish one type from another have no defaults, so a message of another type is an
error and never a robot at the origin. A number that was ``null`` is NaN.

Messages are trees, so types of which a message has many objects are excluded from
garbage collection (``gc=False``): it would stop every thread for longer than the
decoding takes.
"""

import math
from typing import TYPE_CHECKING, ClassVar, TypeAlias

import msgspec

from webmap.base.errors import ProtocolError
from webmap.base.geometry import FARTHEST, Pose, Quaternion, Twist, Vector3
from webmap.ros.arrays import Floats as Floats  # public here
from webmap.ros.arrays import Int8s as Int8s
from webmap.ros.arrays import Numbers as Numbers

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


SECOND = 1_000_000_000
"""One second, in nanoseconds."""


class Time(msgspec.Struct, frozen=True, gc=False):
    """A time of the robot's clock, with the field names of ROS 1 and of ROS 2."""

    secs: int = 0
    nsecs: int = 0
    sec: int = 0
    nanosec: int = 0

    @property
    def seconds(self) -> float:
        """Seconds since the epoch of the robot's clock; 0 if not set.

        Raises:
            ProtocolError: If the nanoseconds are below zero, or one second or more; or
                if the seconds are too large for a number.

        """
        part = self.nsecs or self.nanosec
        if not 0 <= part < SECOND:
            # Python refuses to format an integer of thousands of digits.
            got = str(part) if abs(part) < 1 << 64 else "far too many"
            raise ProtocolError(
                f"a time has {got} nanoseconds; expected 0 to {SECOND - 1}"
            )
        try:
            return (self.secs or self.sec) + 1e-9 * part
        except OverflowError:
            raise ProtocolError(
                "a time has seconds of hundreds of digits; expected up to 4294967295, "
                "as ROS has them"
            ) from None


class Header(msgspec.Struct, frozen=True, gc=False):
    """The time of a measurement, and the frame of its numbers."""

    stamp: Time = Time()
    frame_id: str = ""


class PointMsg(msgspec.Struct, frozen=True, gc=False):
    """``geometry_msgs/Point`` and ``geometry_msgs/Vector3``."""

    x: float
    y: float
    z: float = 0.0

    @property
    def vector(self) -> Vector3:
        """The same numbers as a value of :mod:`webmap.base.geometry`."""
        return Vector3(self.x, self.y, self.z)


class QuaternionMsg(msgspec.Struct, frozen=True, gc=False):
    """``geometry_msgs/Quaternion``, of any norm."""

    x: float
    y: float
    z: float
    w: float

    @property
    def as_sent(self) -> Quaternion:
        """The four numbers. For poses of robots and frames: zeros are refused there."""
        return Quaternion(self.x, self.y, self.z, self.w)

    @property
    def quaternion(self) -> Quaternion:
        """The rotation to draw; zeros, which nobody has set, are none, as in RViz."""
        if self.x == self.y == self.z == self.w == 0.0:
            return Quaternion()
        return self.as_sent


class Unstamped(msgspec.Struct, frozen=True, gc=False):
    """A type without a header, with the same properties as :class:`Stamped`."""

    @property
    def frame_id(self) -> str:
        """Empty: this type has no frame."""
        return ""

    @property
    def stamp(self) -> float:
        """0: this type has no time of measurement."""
        return 0.0


class PoseMsg(Unstamped, frozen=True):
    """``geometry_msgs/Pose``."""

    position: PointMsg
    orientation: QuaternionMsg

    @property
    def planar(self) -> Pose:
        """Position and heading in the plane."""
        return Pose(self.position.x, self.position.y, self.orientation.quaternion.yaw)

    @property
    def usable(self) -> Pose:
        """Position and heading in the plane, checked.

        Raises:
            ProtocolError: If a number is NaN or infinite, the quaternion is almost but
                not exactly zero, or the position is farther away than any robot can be.

        """
        p, q = self.position, self.orientation
        if not all(map(math.isfinite, (p.x, p.y, q.x, q.y, q.z, q.w))):
            raise ProtocolError(
                f"a pose must be of finite numbers, got ({p.x}, {p.y}) with the "
                f"quaternion ({q.x}, {q.y}, {q.z}, {q.w})"
            )
        if max(abs(p.x), abs(p.y)) > FARTHEST:
            raise ProtocolError(
                f"a pose must be within {FARTHEST:g} m of the origin, got "
                f"({p.x:g}, {p.y:g})"
            )
        if FARTHEST < abs(p.z) < math.inf:
            raise ProtocolError(
                f"a pose must be within {FARTHEST:g} m of the plane, got a height of "
                f"{p.z:g}"
            )
        length = q.quaternion.norm
        if length <= 1e-6:
            raise ProtocolError(
                f"a pose has a quaternion of length {length:g}, which is no rotation"
            )
        return self.planar

    @property
    def place(self) -> "PoseMsg":
        """The pose itself; every view of a pose has this property."""
        return self


class Stamped(msgspec.Struct, frozen=True, kw_only=True, gc=False):
    """A type that begins with a header."""

    header: Header = Header()

    @property
    def frame_id(self) -> str:
        """The frame of the numbers."""
        return self.header.frame_id

    @property
    def stamp(self) -> float:
        """Time of the measurement, in seconds of the robot's clock; 0 if not set."""
        return self.header.stamp.seconds


class PoseStampedMsg(Stamped, frozen=True, kw_only=True):
    """``geometry_msgs/PoseStamped``."""

    pose: PoseMsg

    @property
    def place(self) -> PoseMsg:
        """Position and orientation in :attr:`frame_id`."""
        return self.pose


class PoseWithCovarianceMsg(msgspec.Struct, frozen=True):
    """``geometry_msgs/PoseWithCovariance`` without the covariance."""

    pose: PoseMsg


class PoseWithCovarianceStampedMsg(Stamped, frozen=True, kw_only=True):
    """``geometry_msgs/PoseWithCovarianceStamped``."""

    pose: PoseWithCovarianceMsg

    @property
    def place(self) -> PoseMsg:
        """Position and orientation in :attr:`frame_id`."""
        return self.pose.pose


class Pose2DMsg(Unstamped, frozen=True, gc=False):
    """``geometry_msgs/Pose2D``."""

    x: float
    y: float
    theta: float
    """Radians, counter-clockwise."""

    @property
    def place(self) -> PoseMsg:
        """The same pose in space."""
        turned = Quaternion.from_yaw(self.theta)
        return PoseMsg(
            PointMsg(self.x, self.y),
            QuaternionMsg(turned.x, turned.y, turned.z, turned.w),
        )


class TwistMsg(msgspec.Struct, frozen=True):
    """``geometry_msgs/Twist``."""

    linear: PointMsg
    angular: PointMsg

    @property
    def twist(self) -> Twist:
        """The same velocity as a planar :class:`Twist`."""
        linear, angular = self.linear, self.angular
        return Twist(linear.x, linear.y, angular.z, linear.z, angular.x, angular.y)


class TwistWithCovarianceMsg(msgspec.Struct, frozen=True):
    """``geometry_msgs/TwistWithCovariance`` without the covariance."""

    twist: TwistMsg


class OdometryMsg(PoseWithCovarianceStampedMsg, frozen=True, kw_only=True):
    """``nav_msgs/Odometry``: a pose and a velocity."""

    twist: TwistWithCovarianceMsg
    child_frame_id: str = ""

    @property
    def velocity(self) -> Twist:
        """The velocity of the robot's base, in its own frame."""
        return self.twist.twist.twist


class LaserScanMsg(Stamped, frozen=True, kw_only=True):
    """``sensor_msgs/LaserScan``."""

    angle_min: float
    """Bearing of the first ray, in radians, counter-clockwise from x."""

    angle_increment: float
    """Angle between neighbouring rays, in radians; negative for a clockwise sweep."""

    range_min: float
    """Shortest range that the sensor can measure, in metres."""

    range_max: float
    """Longest range that the sensor can measure, in metres."""

    range_values: Floats = msgspec.field(name="ranges")
    """The received ranges; use :attr:`ranges` for calculations."""

    @property
    def ranges(self) -> "NDArray[np.float32]":
        """Measured ranges, in metres, of shape (N,), read-only.

        A binary encoding keeps NaN and infinities. As text, bridges write ``null`` for
        all three, which is NaN here.
        """
        return self.range_values.array()


class BatteryStateMsg(Stamped, frozen=True, kw_only=True):
    """``sensor_msgs/BatteryState``."""

    percentage: float
    """Charge from 0 to 1; NaN if the battery does not measure it."""

    voltage: float
    """Volts."""

    power_supply_status: int = 0
    """1 charging, 2 discharging, 3 not charging, 4 full, 0 unknown."""


class MapMetaDataMsg(msgspec.Struct, frozen=True):
    """``nav_msgs/MapMetaData``."""

    resolution: float
    """Metres per cell."""

    width: int
    """Cells along x."""

    height: int
    """Cells along y."""

    origin: PoseMsg
    """Pose of the corner of cell (0, 0)."""


MAX_CELLS = 1 << 26
"""Most cells of a grid."""


def cells_of(data: Int8s, width: int, height: int) -> "NDArray[np.int8]":
    """Return the cells of a grid, of shape (height, width), read-only.

    Raises:
        ProtocolError: If there are no cells, too many, or not width times height.

    """
    size = f"a grid of {width} x {height} cells"
    if width < 1 or height < 1:
        raise ProtocolError(f"got {size}, expected at least 1 x 1")
    if width * height > MAX_CELLS:
        raise ProtocolError(f"got {size}, expected at most {MAX_CELLS} in all")
    if width * height != len(data):
        raise ProtocolError(f"got {len(data)} cells for {size}")
    return data.array().reshape(height, width)


class OccupancyGridMsg(Stamped, frozen=True, kw_only=True):
    """``nav_msgs/OccupancyGrid``."""

    info: MapMetaDataMsg
    data: Int8s

    @property
    def cells(self) -> "NDArray[np.int8]":
        """The cells, of shape (height, width), read-only; -1 is unknown.

        Raises:
            ProtocolError: If the number of cells is not width times height.

        """
        return cells_of(self.data, self.info.width, self.info.height)


class PathMsg(Stamped, frozen=True, kw_only=True):
    """``nav_msgs/Path``."""

    poses: list[PoseStampedMsg]

    @property
    def frame_id(self) -> str:
        """The frame of the header; without one, the first frame of a pose."""
        frames = (pose.frame_id for pose in self.poses)
        return self.header.frame_id or next(filter(None, frames), "")


class TransformMsg(msgspec.Struct, frozen=True, gc=False):
    """``geometry_msgs/Transform``."""

    translation: PointMsg
    rotation: QuaternionMsg

    @property
    def planar(self) -> Pose:
        """The transform seen from above: x and y in metres, yaw in radians."""
        place = self.translation
        return Pose(place.x, place.y, self.rotation.quaternion.yaw)


class TransformStampedMsg(Stamped, frozen=True, kw_only=True):
    """``geometry_msgs/TransformStamped``."""

    child_frame_id: str
    transform: TransformMsg

    @property
    def row(self) -> "TransformRow":
        """The same values without objects."""
        stamp, move = self.header.stamp, self.transform
        p, q = move.translation, move.rotation
        times = stamp.secs, stamp.nsecs, stamp.sec, stamp.nanosec
        names = self.header.frame_id, self.child_frame_id
        return (*times, *names, p.x, p.y, p.z, q.x, q.y, q.z, q.w)


# fmt: off
TransformRow: TypeAlias = tuple[
    int, int, int, int, str, str, float, float, float, float, float, float, float
]
# fmt: on
"""The values of a :class:`TransformStampedMsg`, in the order of its fields."""


class TFMessage(msgspec.Struct, frozen=True):
    """``tf2_msgs/TFMessage``."""

    separable: ClassVar = True
    """Whether the parts of a long message may be delivered one after the other."""

    transforms: list[TransformStampedMsg | TransformRow]
    """Rows if the message was serialized: six objects for each take twice as long."""

    @property
    def rows(self) -> list[TransformRow]:
        """The values of each transform."""
        return [
            each if isinstance(each, tuple) else each.row for each in self.transforms
        ]


LOG_LEVELS = ("debug", "info", "warn", "error", "fatal")
"""The names of the levels, from the least severe."""

_LOG_LEVELS_ROS1 = {1: "debug", 2: "info", 4: "warn", 8: "error", 16: "fatal"}


class LogMsg(msgspec.Struct, frozen=True):
    """``rosgraph_msgs/Log`` of ROS 1 and ``rcl_interfaces/Log`` of ROS 2."""

    level: int
    name: str
    """The name of the node or the logger."""

    msg: str
    header: Header | None = None
    """Present in ROS 1."""

    time: Time = msgspec.field(name="stamp", default=Time())
    """Present in ROS 2; use :attr:`stamp` for both."""

    @property
    def stamp(self) -> float:
        """Time of the log message, in seconds of the robot's clock."""
        return (self.time if self.header is None else self.header.stamp).seconds

    @property
    def level_name(self) -> str:
        """One of :data:`LOG_LEVELS`: powers of two in ROS 1, tens in ROS 2.

        A value between two levels gives the lower one; a value outside of all levels
        gives the nearest.
        """
        if self.header is not None and self.level in _LOG_LEVELS_ROS1:
            return _LOG_LEVELS_ROS1[self.level]
        return LOG_LEVELS[min(max(self.level // 10 - 1, 0), len(LOG_LEVELS) - 1)]
