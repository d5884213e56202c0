"""Where a robot is in the frame of the map, from its odometry and the frames."""

import math
from dataclasses import replace

from webmap.core.odometry import PoseReading
from webmap.tf import Buffer, NotKnownThen, Transform, TransformError


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
        self.problem: str | None = None
        """Why poses stay in the frame that they came in, in a sentence."""

    def of_reading(self, reading: PoseReading) -> PoseReading:
        """Return a pose in the frame of the map.

        It is taken there as the frames were at its stamp, so that it does not lag
        behind while the robot turns. A pose that is newer than the frames is taken
        there by the newest; one whose frame was never seen stays as it came.
        """
        frame = self._buffer.name(reading.frame_id, self._namespace)
        if not frame or frame == self.map_frame:
            self.problem = None
            return reading
        try:
            map_from_frame = self._lookup(frame, reading.stamp)
            self._known[frame] = map_from_frame
            self.problem = None
        except TransformError as error:
            self.problem = f"it is drawn where {frame!r} has it: {error}"
            if frame not in self._known:
                return reading
            map_from_frame = self._known[frame]
        placed = map_from_frame @ Transform(reading.position, reading.orientation)
        return replace(
            reading, position=placed.translation, orientation=placed.rotation
        )

    def of_base(self) -> PoseReading | None:
        """Return where the frames have the base; None if they say nothing new of it."""
        try:
            newest = self._buffer.newest(self.map_frame, self.base_frame) or 0.0
            if newest == self._newest:
                return None
            self._newest = newest
            placed = self._buffer.lookup(self.map_frame, self.base_frame)
        except TransformError as error:
            self.problem = f"its place is not known: {error}"
            return None
        self.problem = None
        return PoseReading(placed.translation, placed.rotation)

    def _lookup(self, frame: str, stamp: float) -> Transform:
        if stamp:
            try:
                return self._buffer.lookup(self.map_frame, frame, stamp)
            except NotKnownThen:
                pass
        return self._buffer.lookup(self.map_frame, frame)
