"""The pose of a message's frame at the time of measurement."""

import msgspec

from webmap.base.geometry import Pose
from webmap.core.pose_source import PoseSource
from webmap.poses.placing import OTHER_CLOCK, Placing
from webmap.ros.tf import Buffer, NotKnownThen, Transform, TransformError

AHEAD = 0.2
"""Seconds for which a motion is extrapolated."""

SOON = 0.5
"""Seconds within which frames and poses usually reach a stamp."""

FLOWING = 1.0
"""Greatest age of the newest pose while poses count as arriving, in seconds."""


class Sighting(msgspec.Struct, frozen=True, gc=False):
    """The pose of data, as far as it is known now."""

    offset: Transform
    """The transform from its coordinates to the robot's own map, or to the robot."""

    ground: float = 0.0
    """Height of the robot's base, from which heights are measured, in metres."""

    on_robot: bool = False
    """Whether :attr:`offset` is on the robot and moves with it."""

    settled: bool = True
    """Whether the result is final: later poses and frames would not change it."""

    trouble: str = ""
    """The kind of trouble, or empty; the sentences of one kind may differ."""

    text: str = ""
    """The trouble in a sentence."""


class Sightings:
    """Finds the poses of a robot's sensors at a stamp.

    Args:
        poses: The poses of the robot, and the frames that place it.
        frame: ``"map"`` if data without a frame is in the map's, ``"robot"`` if it is
            in the robot's.
        mount: The configured pose of the sensor on the robot, if any; the sensor's
            frame is then ignored.

    """

    def __init__(self, poses: PoseSource, frame: str, mount: Pose | None) -> None:
        self._poses = poses
        self._in_map = frame == "map"
        self._is_mounted = mount is not None
        self._mount = Transform.from_pose(mount or Pose())
        self._known: dict[str, Transform] = {}

    def look(self, frame_id: str, stamp: float) -> Sighting:
        """Return the pose of data of a frame at a stamp.

        Args:
            frame_id: The frame of the message; empty if it has none.
            stamp: In seconds of the robot's clock; 0 if there is none.

        """
        placing = self._poses.pipeline.placing
        if self._in_map and (placing is None or self._is_mounted or not frame_id):
            return Sighting(self._mount)
        if placing is None:
            return self._by_poses(self._mount, stamp)
        source = placing.name(frame_id) or placing.base_frame
        if self._is_mounted:
            source = placing.base_frame
        if self._in_map:
            return self._on_map(placing, source, stamp)
        return self._carried(placing, source, stamp)

    def _on_map(self, placing: Placing, source: str, stamp: float) -> Sighting:
        """Return the pose of map data that arrived in another frame."""
        try:
            found, settled = newest_or_at(
                placing.buffer, placing.map_frame, source, stamp
            )
        except TransformError as error:
            found = self._known.get(source, Transform())
            return _lost(placing, source, error, Sighting(found))
        self._known[source] = found
        return Sighting(found, settled=settled)

    def _carried(self, placing: Placing, source: str, stamp: float) -> Sighting:
        """Return the pose of a sensor on the robot."""
        buffer, base, world = placing.buffer, placing.base_frame, placing.map_frame
        mount = self._mount
        if stamp:
            try:
                found, on = buffer.lookup_carried(world, source, base, stamp)
                ground = 0.0 if on is None else on.translation.z
                return Sighting(found @ mount, ground)
            except TransformError:
                pass  # The poses may be known when the frames are not.
        if source != base:
            try:
                self._known[source], _ = newest_or_at(buffer, base, source, stamp)
            except TransformError as error:
                found = self._known.get(source, Transform())
                return _lost(placing, source, error, self._by_poses(found, stamp))
            mount = self._known[source] @ mount
        by_poses = self._by_poses(mount, stamp)
        if by_poses.settled and not by_poses.trouble:
            return by_poses
        ahead = _ahead(buffer, world, base, stamp)
        if ahead is None:
            return by_poses
        return Sighting(ahead @ mount, ahead.translation.z, settled=False)

    def _by_poses(self, mount: Transform, stamp: float) -> Sighting:
        """Return the pose of a sensor from the robot's poses."""
        on_robot = Sighting(mount, on_robot=True)
        pipeline = self._poses.pipeline
        newest = pipeline.newest_stamp
        if not stamp or newest is None:
            return on_robot
        try:
            base = pipeline.at(stamp)
            return Sighting(base @ mount, base.translation.z)
        except NotKnownThen as error:
            reason = error
        if newest < stamp <= newest + SOON:
            reach = min(stamp, newest + AHEAD)
            base = pipeline.at(reach, AHEAD)
            return Sighting(base @ mount, base.translation.z, settled=False)
        if not self._poses.received_within(FLOWING):
            return on_robot
        if pipeline.placing is None and abs(stamp - newest) <= OTHER_CLOCK:
            return on_robot  # without frames nothing better is expected
        return Sighting(
            mount,
            on_robot=True,
            settled=stamp <= newest,
            trouble="then",
            text=f"the pose of the robot at the stamp of the data is unknown, so "
            f"the data is drawn at the current pose: {reason}; are the clocks of the "
            f"sensor and of the odometry the same?",
        )


def _lost(
    placing: Placing, source: str, error: TransformError, otherwise: Sighting
) -> Sighting:
    """Return the fallback pose of data whose frame is unknown, with the trouble."""
    if placing.quiet:
        return otherwise
    return msgspec.structs.replace(
        otherwise,
        settled=False,
        trouble=f"{type(error).__name__} {source}",
        text=f"the pose of {source!r} is unknown: {error}",
    )


def newest_or_at(
    buffer: Buffer, target: str, source: str, stamp: float
) -> tuple[Transform, bool]:
    """Return a frame in another, and whether the result is final.

    It is the transform at the stamp if that is known, and otherwise the newest one.
    """
    if source == target:
        return Transform(), True
    found = buffer.find(target, source, stamp)
    newest = found.newest
    coming = bool(stamp) and newest is not None and newest < stamp <= newest + SOON
    return found.transform, found.on_time or not coming


def _ahead(buffer: Buffer, target: str, source: str, stamp: float) -> Transform | None:
    """Return an extrapolated frame; None if its newest transform is too old."""
    try:
        newest = buffer.newest(target, source)
        if newest is None or not newest < stamp <= newest + SOON:
            return None
        return buffer.lookup(target, source, min(stamp, newest + AHEAD), ahead=AHEAD)
    except TransformError:
        return None
