"""Readings of a robot's pose, and their transform to the robot's map."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, TypeAlias

from webmap.base.errors import ConfigError, ProtocolError
from webmap.base.geometry import FARTHEST, Quaternion, Twist, Vector3
from webmap.ros import messages
from webmap.ros.decoding import convert
from webmap.ros.names import split_type
from webmap.ros.tf import Buffer, Transform, TransformError

OTHER_CLOCK = 60.0
"""Seconds between two stamps of one moment beyond which they are from different clocks;
less may be a recording put together from several."""

LATE = 2.0
"""Seconds without a new transform of a frame after which that is a problem."""

CLOCKS = "clocks"
"""The kind of problem that poses and frames have different clocks."""


OdometryView: TypeAlias = (
    messages.OdometryMsg
    | messages.PoseWithCovarianceStampedMsg
    | messages.PoseStampedMsg
    | messages.PoseMsg
    | messages.Pose2DMsg
)
"""Views of a pose: with ``place``, ``frame_id`` and ``stamp``."""

# By shape alone, the order matters: types with more fields come first.
ODOMETRY_VIEWS: dict[str, type[OdometryView]] = {
    "nav_msgs/Odometry": messages.OdometryMsg,
    "geometry_msgs/PoseWithCovarianceStamped": messages.PoseWithCovarianceStampedMsg,
    "geometry_msgs/PoseStamped": messages.PoseStampedMsg,
    "geometry_msgs/Pose": messages.PoseMsg,
    "geometry_msgs/Pose2D": messages.Pose2DMsg,
}
"""The views of the types that hold a robot's pose, by the name in ROS 1."""


def odometry_view(type: str) -> type[OdometryView]:
    """Return the view of a type that holds a robot's pose, in either dialect.

    Raises:
        ConfigError: If the type does not hold a robot's pose.

    """
    view = ODOMETRY_VIEWS.get(str(split_type(type)))
    if view is None:
        known = ", ".join(ODOMETRY_VIEWS)
        raise ConfigError(
            f"{type!r} has no pose of a robot; these types have one: {known}"
        )
    return view


def odometry_view_by_shape(message: Mapping[str, Any]) -> type[OdometryView]:
    """Return the view that fits a plain message of unknown type.

    Raises:
        ProtocolError: If the message holds no robot's pose.

    """
    for view in ODOMETRY_VIEWS.values():
        try:
            convert(message, view)
        except ProtocolError:
            continue
        return view
    known = ", ".join(ODOMETRY_VIEWS)
    raise ProtocolError(
        f"a message with the fields {', '.join(sorted(message))} "
        f"has no pose of a robot; these types have one: {known}"
    )


class PoseReading(NamedTuple):
    """The pose of a robot in one message, and its velocity if the message has one."""

    position: Vector3
    orientation: Quaternion
    twist: Twist | None = None
    frame_id: str = ""
    """The frame of the pose; empty if the message names none."""

    stamp: float = 0.0
    """The time of measurement in seconds of the robot's clock; 0 if unknown."""

    @classmethod
    def of(cls, message: OdometryView) -> "PoseReading":
        """Return the pose of a message, with velocity if it is odometry."""
        place = message.place
        p, q = place.position, place.orientation
        return cls(
            Vector3(p.x, p.y, p.z),
            Quaternion(q.x, q.y, q.z, q.w),
            message.velocity if isinstance(message, messages.OdometryMsg) else None,
            message.frame_id,
            message.stamp,
        )

    @property
    def is_usable(self) -> bool:
        """Whether position and orientation are valid and can be drawn."""
        p, q = self.position, self.orientation
        # Comparisons with NaN are false.
        return (
            abs(p.x) < FARTHEST
            and abs(p.y) < FARTHEST
            and abs(p.z) < FARTHEST
            and 1e-6 < q.norm < FARTHEST
        )

    @property
    def transform(self) -> Transform:
        """The transform from coordinates of the robot to those of the pose's frame."""
        return Transform(self.position, self.orientation)

    def moved(self, by: Transform, frame_id: str) -> "PoseReading":
        """Return the pose in another frame, to which ``by`` transforms it."""
        placed = by @ self.transform
        return PoseReading(
            placed.translation, placed.rotation, self.twist, frame_id, self.stamp
        )


class Placing:
    """Transforms a robot's poses to the frame of its map.

    Args:
        buffer: The received frames.
        namespace: The namespace of their topic; see :meth:`Buffer.name`.
        map_frame: The frame that the robot is drawn in.
        base_frame: The robot's own frame.
        quiet: Whether poses that cannot be transformed are no problem.

    """

    def __init__(
        self,
        buffer: Buffer,
        namespace: str,
        map_frame: str,
        base_frame: str,
        *,
        quiet: bool = False,
    ) -> None:
        self.buffer = buffer
        self._namespace = namespace
        self.map_frame = self.name(map_frame)
        self.base_frame = self.name(base_frame)
        self.quiet = quiet
        self.kind = ""
        """The kind of the current problem with the frames; empty if there is none."""
        self.problem = ""
        """The problem in a sentence."""
        self._known: dict[str, Transform] = {}
        self._newest = -math.inf
        self._last_changes: dict[str, tuple[float, float]] = {}

    def name(self, frame: str) -> str:
        """Return the full name of a frame that the robot names."""
        return self.buffer.name(frame, self._namespace)

    def of_reading(self, reading: PoseReading, now: float) -> PoseReading:
        """Return a pose in the frame of the map.

        It is transformed with the frames at its stamp, so that it does not lag while
        the robot turns. A pose that is newer than the frames is transformed with the
        newest; a pose whose frame was never seen is not transformed.

        Args:
            reading: The pose.
            now: When it arrived, in seconds of any monotonic clock.

        """
        frame = self.name(reading.frame_id)
        if not frame or frame == self.map_frame:
            self.kind = ""
            return reading._replace(frame_id=frame)
        try:
            found = self.buffer.find(self.map_frame, frame, reading.stamp)
        except TransformError as error:
            self._set_problem(
                error, f"the robot is drawn in {frame!r}, not on the map: {error}"
            )
            if frame not in self._known:
                return reading._replace(frame_id=frame)
        else:
            self._known[frame] = found.transform
            self._check_for_new_transforms(frame, found.newest, now)
            self._check_clocks(frame, found.newest, reading.stamp)
        return reading.moved(self._known[frame], self.map_frame)

    def of_base(self, now: float) -> PoseReading | None:
        """Return the pose of the base in TF; None if it has not changed.

        Args:
            now: The time of any monotonic clock, in seconds.

        """
        base = self.base_frame
        try:
            newest = self.buffer.newest(self.map_frame, base)
            self._check_for_new_transforms(base, newest, now)
            newest = newest or 0.0
            if newest == self._newest:
                return None
            placed = self.buffer.lookup(self.map_frame, base)
        except TransformError as error:
            self._set_problem(error, f"the pose of the robot is unknown: {error}")
            return None
        self._newest = newest
        return PoseReading(
            placed.translation, placed.rotation, None, self.map_frame, newest
        )

    def _check_for_new_transforms(
        self, frame: str, newest: float | None, now: float
    ) -> None:
        """Set a problem if a frame gets no new transforms; static frames need none."""
        before, changed_at = self._last_changes.get(frame, (None, now))
        if newest is None or newest != before:
            changed_at = now
            self._last_changes[frame] = (newest or 0.0, now)
        self.kind = ""
        if now > changed_at + LATE:
            self.kind = "late"
            self.problem = (
                f"no new transform {self.map_frame!r} -> {frame!r} for more than "
                f"{LATE:g} s, the shown pose may be wrong: check the node that "
                f"publishes it"
            )

    def _check_clocks(self, frame: str, newest: float | None, stamp: float) -> None:
        """Set a problem if a pose and the frames cannot have the same clock."""
        if self.kind or not stamp or newest is None:
            return
        apart = stamp - newest
        if abs(apart) > OTHER_CLOCK:
            self.kind = CLOCKS
            self.problem = (
                f"its odometry is stamped {abs(apart):.1f} s "
                f"{'later' if apart > 0 else 'earlier'} than the newest of "
                f"{self.map_frame!r} -> {frame!r}, so the robot is drawn by the newest "
                f"transform: are the clocks of both the same?"
            )

    def _set_problem(self, error: TransformError, text: str) -> None:
        self.kind, self.problem = type(error).__name__, text


PROBLEM_DELAY = 1.0
"""Seconds for which trouble must last before it is shown: when a connection opens,
frames arrive one after another, which is no trouble."""


class ProblemDelay:
    """Determines when trouble has lasted for a while."""

    def __init__(self) -> None:
        self._since: float | None = None

    def due(self, trouble: str, now: float, earliest: float) -> float | None:
        """Return when to show the trouble; None if there is none.

        Args:
            trouble: The current kind; empty if there is none.
            now: The time of any monotonic clock, in seconds.
            earliest: The earliest time to show it.

        """
        if not trouble:
            self._since = None
            return None
        if self._since is None:
            self._since = now
        return max(self._since + PROBLEM_DELAY, earliest)
