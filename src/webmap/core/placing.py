"""Where a robot is in the frame of the map, from its odometry and the frames."""

import math
from dataclasses import replace

from webmap.core.odometry import PoseReading
from webmap.tf import Buffer, NotKnownThen, Transform, TransformError

OTHER_CLOCK = 60.0
"""Seconds between two stamps of one moment beyond which they are by different clocks;
what is less may be a recording that was put together."""

LATE = 2.0
"""Seconds for which nothing new is told of a way before that is said."""

CLOCKS = "clocks"
"""The kind of trouble that poses and frames have other clocks."""


class Placing:
    """Takes poses of a robot to the frame of the map.

    Args:
        buffer: What is known of the frames.
        map_frame: The frame that robots are drawn in.
        base_frame: The robot's own frame.
        namespace: Of the topics that the frames come from.

    """

    def __init__(
        self, buffer: Buffer, map_frame: str, base_frame: str, namespace: str = ""
    ) -> None:
        self.map_frame = buffer.name(map_frame, namespace)
        self.base_frame = buffer.name(base_frame, namespace)
        self._buffer = buffer
        self._namespace = namespace
        self._known: dict[str, Transform] = {}
        self._newest = -math.inf
        self._news: dict[str, tuple[float, float]] = {}
        self.problem: str | None = None
        """What is wrong with the frames that the robot is drawn by, in a sentence."""
        self.kind = ""
        """Which kind of trouble that is; the words of one kind may differ."""

    def of_reading(self, reading: PoseReading, now: float) -> PoseReading:
        """Return a pose in the frame of the map.

        It is taken there as the frames were at its stamp, so that it does not lag
        behind while the robot turns. A pose that is newer than the frames is taken
        there by the newest; one whose frame was never seen stays as it came.

        Args:
            reading: The pose.
            now: When it came, in seconds of any clock that only goes forward.

        """
        frame = self._buffer.name(reading.frame_id, self._namespace)
        if not frame or frame == self.map_frame:
            self._mended()
            return replace(reading, frame_id=frame)
        try:
            map_from_frame = self._lookup(frame, reading.stamp)
            self._known[frame] = map_from_frame
            self._look_whether_it_stopped(frame, now)
            self._look_at_clocks(frame, reading.stamp)
        except TransformError as error:
            self._wrong(error, f"it is drawn where {frame!r} has it: {error}")
            if frame not in self._known:
                return replace(reading, frame_id=frame)
            map_from_frame = self._known[frame]
        placed = map_from_frame @ Transform(reading.position, reading.orientation)
        return replace(
            reading,
            position=placed.translation,
            orientation=placed.rotation,
            frame_id=self.map_frame,
        )

    def of_base(self, now: float) -> PoseReading | None:
        """Return where the frames have the base; None if they say nothing new of it.

        Args:
            now: The time, in seconds of any clock that only goes forward.

        """
        try:
            newest = self._buffer.newest(self.map_frame, self.base_frame) or 0.0
            self._look_whether_it_stopped(self.base_frame, now)
            if newest == self._newest:
                return None
            placed = self._buffer.lookup(self.map_frame, self.base_frame)
            self._newest = newest
        except TransformError as error:
            self._wrong(error, f"its place is not known: {error}")
            return None
        return PoseReading(
            placed.translation,
            placed.rotation,
            frame_id=self.map_frame,
            stamp=newest,
        )

    def _lookup(self, frame: str, stamp: float) -> Transform:
        if stamp:
            try:
                return self._buffer.lookup(self.map_frame, frame, stamp)
            except NotKnownThen:
                pass
        return self._buffer.lookup(self.map_frame, frame)

    def _look_whether_it_stopped(self, frame: str, now: float) -> None:
        """Say so if nothing new comes of a way; what is static need not."""
        newest = self._buffer.newest(self.map_frame, frame)
        said, heard = self._news.get(frame, (None, now))
        if newest is None or newest != said:
            heard = now
            self._news[frame] = (newest or 0.0, now)
        if now <= heard + LATE:
            self._mended()
        else:
            self.kind = "late"
            self.problem = (
                f"nothing new of {self.map_frame!r} -> {frame!r} was told for more "
                f"than {LATE:g} s, so it may be somewhere else: does what publishes "
                f"it still run?"
            )

    def _look_at_clocks(self, frame: str, stamp: float) -> None:
        """Say so if a pose and the frames cannot be by one clock."""
        newest = self._buffer.newest(self.map_frame, frame)
        if self.kind or not stamp or newest is None:
            return
        apart = stamp - newest
        if abs(apart) > OTHER_CLOCK:
            self.kind = CLOCKS
            self.problem = (
                f"its odometry is stamped {abs(apart):.1f} s "
                f"{'later' if apart > 0 else 'earlier'} than the newest of "
                f"{self.map_frame!r} -> {frame!r}, so it is drawn by the newest: are "
                f"the clocks of both the same?"
            )

    def _wrong(self, error: TransformError, words: str) -> None:
        self.kind, self.problem = type(error).__name__, words

    def _mended(self) -> None:
        self.kind, self.problem = "", None
