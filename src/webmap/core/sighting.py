"""Where the frame of a message was when the message was measured."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from webmap.core.frames import frames_of
from webmap.core.placing import OTHER_CLOCK
from webmap.geometry import Pose
from webmap.tf import Buffer, NotKnownThen, Transform, TransformError

if TYPE_CHECKING:
    from webmap.core.robot import Robot

AHEAD = 0.2
"""Seconds for which a motion is taken to go on as it did."""

SOON = 0.5
"""Seconds within which frames and poses catch up with a stamp, as a rule."""

FLOWING = 1.0
"""Seconds since the newest pose within which poses are said to be coming."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """Where data is, as well as that is known by now."""

    offset: Transform
    """What takes its coordinates to those of the robot's own map; or to the robot's."""

    ground: float = 0.0
    """Where heights begin: how high the robot's base is there, in metres."""

    on_robot: bool = False
    """Whether :attr:`offset` is on the robot, and goes with it."""

    settled: bool = True
    """Whether more news would not change it."""

    trouble: str = ""
    """Which kind of trouble there is, if any; the words of one kind may differ."""

    words: str = ""
    """What is wrong, in a sentence."""


class Sightings:
    """Looks where a robot's sensors were.

    Args:
        robot: The robot.
        frame: ``"map"`` if data without a frame is in the map's, ``"robot"`` if it is
            in the robot's.
        mount: Where the sensor is on the robot, if that was told; what frames say of it
            is then left alone.

    """

    def __init__(self, robot: "Robot", frame: str, mount: Pose | None) -> None:
        self._robot = robot
        self._in_map = frame == "map"
        self._mount = mount
        self._known: dict[str, Transform] = {}

    def look(self, frame_id: str, stamp: float) -> Sighting:
        """Return where data of a frame was at a stamp.

        Args:
            frame_id: As the message names it; empty if it does not say.
            stamp: In seconds of the robot's clock; 0 if not said.

        """
        tf = self._robot.tf
        if self._in_map and (tf is None or self._mount or not frame_id):
            return Sighting(_mounted(self._mount))
        if tf is None:
            return self._by_poses(_mounted(self._mount), stamp)
        buffer = frames_of(tf["bridge"], tf["namespace"]).buffer
        source = buffer.name(frame_id, tf["namespace"]) or tf["base_frame"]
        if self._mount is not None:
            source = tf["base_frame"]
        if self._in_map:
            return self._on_map(buffer, tf, source, stamp)
        return self._carried(buffer, tf, source, stamp)

    def _on_map(
        self, buffer: Buffer, tf: Mapping[str, Any], source: str, stamp: float
    ) -> Sighting:
        """Return where data of the map is that came in another frame."""
        target = tf["map_frame"]
        try:
            found, settled = newest_or_at(buffer, target, source, stamp)
        except TransformError as error:
            found = self._known.get(source, Transform())
            return self._lost(tf, source, error, Sighting(found))
        self._known[source] = found
        return Sighting(found, settled=settled)

    def _carried(
        self, buffer: Buffer, tf: Mapping[str, Any], source: str, stamp: float
    ) -> Sighting:
        """Return where a sensor was that the robot carries."""
        base, world = tf["base_frame"], tf["map_frame"]
        mount = _mounted(self._mount)
        if stamp:
            try:
                found = buffer.lookup(world, source, stamp)
                ground = _height(buffer, world, base, stamp)
                return Sighting(found @ mount, ground)
            except TransformError:
                pass  # The poses may tell what the frames do not.
        if source != base:
            try:
                self._known[source], _ = newest_or_at(buffer, base, source, stamp)
            except TransformError as error:
                found = self._known.get(source, Transform())
                return self._lost(tf, source, error, self._by_poses(found, stamp))
            mount = self._known[source] @ mount
        by_poses = self._by_poses(mount, stamp)
        if by_poses.settled and not by_poses.trouble:
            return by_poses
        ahead = _ahead(buffer, world, base, stamp)
        if ahead is None:
            return by_poses
        return Sighting(ahead @ mount, ahead.translation.z, settled=False)

    def _by_poses(self, mount: Transform, stamp: float) -> Sighting:
        """Return where the robot's poses have a sensor."""
        on_robot = Sighting(mount, on_robot=True)
        where = self._robot.whereabouts
        newest = where.newest_stamp
        if not stamp or newest is None:
            return on_robot
        try:
            base = where.at(stamp)
            return Sighting(base @ mount, base.translation.z)
        except NotKnownThen as error:
            reason = error
        if newest < stamp <= newest + SOON:
            reach = min(stamp, newest + AHEAD)
            base = where.at(reach, AHEAD)
            return Sighting(base @ mount, base.translation.z, settled=False)
        if not self._robot.hears_poses(FLOWING):
            return on_robot
        if self._robot.tf is None and abs(stamp - newest) <= OTHER_CLOCK:
            return on_robot  # who has no frames does not ask for more
        return Sighting(
            mount,
            on_robot=True,
            settled=stamp <= newest,
            trouble="then",
            words=f"it is not known where the robot was at the stamp of what is drawn, "
            f"so it is drawn where the robot is now: {reason}; are the clocks of the "
            f"sensor and of the odometry the same?",
        )

    def _lost(
        self,
        tf: Mapping[str, Any],
        source: str,
        error: TransformError,
        otherwise: Sighting,
    ) -> Sighting:
        if tf["quiet"]:
            return otherwise
        return replace(
            otherwise,
            settled=False,
            trouble=f"{type(error).__name__} {source}",
            words=f"it is not known where {source!r} is: {error}",
        )


def _mounted(mount: Pose | None) -> Transform:
    return Transform.from_pose(mount or Pose())


def newest_or_at(
    buffer: Buffer, target: str, source: str, stamp: float
) -> tuple[Transform, bool]:
    """Return a frame in another, and whether more news would not change it.

    It is as it was at the stamp if that is known, and else as it is now.
    """
    if source == target:
        return Transform(), True
    if stamp:
        try:
            return buffer.lookup(target, source, stamp), True
        except NotKnownThen:
            pass
    newest = buffer.newest(target, source)
    coming = bool(stamp) and newest is not None and newest < stamp <= newest + SOON
    return buffer.lookup(target, source), not coming


def _height(buffer: Buffer, target: str, base: str, stamp: float) -> float:
    """Return how high the base is; as if it were on the ground if nobody tells."""
    try:
        return newest_or_at(buffer, target, base, stamp)[0].translation.z
    except TransformError:
        return 0.0


def _ahead(buffer: Buffer, target: str, source: str, stamp: float) -> Transform | None:
    """Return where a frame gets that goes on as it did; None if it is too long ago."""
    try:
        newest = buffer.newest(target, source)
        if newest is None or not newest < stamp <= newest + SOON:
            return None
        return buffer.lookup(target, source, min(stamp, newest + AHEAD), ahead=AHEAD)
    except TransformError:
        return None
