"""Where a robot is, and where it was when its sensors measured."""

import math
from collections.abc import Callable
from dataclasses import replace

from webmap.core.alignment import HERE, alignments
from webmap.core.jumps import BACK, Jumps
from webmap.core.odometry import PoseReading
from webmap.geometry import Affine, Pose
from webmap.ros.bridge import Bridge
from webmap.scope import Removal
from webmap.tf import Transform
from webmap.tf.track import Track

HISTORY = 10.0
"""Seconds of poses that are kept."""

GAP = 1.0
"""Seconds between two poses beyond which nothing is told in between."""


class Whereabouts:
    """The poses of one robot, by the stamps of its own clock, and who hears of them.

    Poses come in the robot's own map, and are given on the common one, where the
    robot's alignment has them.
    """

    def __init__(self) -> None:
        self.jumps = Jumps()
        self.newest: PoseReading | None = None
        """The newest pose, in the robot's own map."""
        self._gap = GAP
        self._track = Track("")
        self._own: Pose | None = None
        self._bridge: Bridge | None = None
        self._hears = Removal(lambda: None)
        self._listeners: dict[int, Callable[[], object]] = {}

    # Where its own map lies.

    @property
    def alignment(self) -> Pose:
        """Where the robot's own map lies on the common one."""
        return alignments.of(self._bridge) if self._own is None else self._own

    @property
    def own_alignment(self) -> Pose | None:
        """The robot's own alignment; None if it goes with its bridge."""
        return self._own

    @property
    def bridge(self) -> Bridge | None:
        """The bridge that its poses come from."""
        return self._bridge

    def align(self, pose: Pose | None) -> None:
        """Set the robot's own alignment; with None it goes with its bridge."""
        self._own = pose

    def come_from(self, bridge: Bridge | None, changed: Callable[[], object]) -> None:
        """Note the bridge of the poses, and call ``changed`` when that is aligned."""
        self._hears.remove()
        self._bridge = bridge
        if bridge is not None:
            self._hears = alignments.on_change(bridge, changed)

    @property
    def placing(self) -> Affine:
        """What takes points of the robot's own map to the common one."""
        return affine(self.alignment)

    # Where it is.

    def take(self, reading: PoseReading, period: float = 0.0) -> PoseReading:
        """Take a pose of the robot's own map, and return it on the common one.

        Args:
            reading: The pose.
            period: Seconds between two of them, if that is known.

        """
        if self.newest is not None and self.newest.frame_id != reading.frame_id:
            self._track.clear()  # Its numbers are of another frame.
        self.newest = reading
        self._gap = max(GAP, 2.5 * period)
        if reading.stamp:
            newest = self._track.newest
            if newest is not None and reading.stamp < newest - BACK:
                self._track.clear()
            pose = Transform(reading.position, reading.orientation)
            self._track.add(pose, reading.stamp, HISTORY)
        return self.on_map(reading)

    def on_map(self, reading: PoseReading) -> PoseReading:
        """Return a pose of the robot's own map on the common one."""
        place = self.alignment
        if place == HERE:
            return reading
        moved = Transform.from_pose(place) @ Transform(
            reading.position, reading.orientation
        )
        return replace(reading, position=moved.translation, orientation=moved.rotation)

    def at(self, stamp: float, ahead: float = 0.0) -> Transform:
        """Return where the robot was, in its own map.

        Args:
            stamp: When, in seconds of the robot's clock.
            ahead: How long after the newest pose it is taken to go on as it did, in
                seconds.

        Raises:
            NotKnownThen: If no pose tells.

        """
        return self._track.at(stamp, self._gap, ahead)

    @property
    def newest_stamp(self) -> float | None:
        """The newest stamp; None if poses have none."""
        return self._track.newest

    def forget(self) -> None:
        """Forget all poses: those to come are from somewhere else."""
        self.newest = None
        self._track.clear()
        self.jumps.forget()

    # Who hears of it.

    def join(self, listener: Callable[[], object]) -> Removal:
        """Call ``listener`` whenever there is news, until the removal."""
        key = id(listener)
        self._listeners[key] = listener
        return Removal(lambda: self._listeners.pop(key, None))

    def tell(self) -> None:
        """Say that there is news: of the pose, of the frames or of the alignment."""
        for listener in tuple(self._listeners.values()):
            listener()


def affine(pose: Pose) -> Affine:
    """Return what takes coordinates of a pose's own frame to the outer one."""
    cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
    return Affine(cos, sin, -sin, cos, pose.x, pose.y)
