"""Where markers are: each in the frame that it names itself."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from webmap.core.alignment import alignments
from webmap.core.frames import Frames, frames_of
from webmap.core.layer import Layer
from webmap.core.pose_troubles import Lasting
from webmap.core.sighting import newest_or_at
from webmap.geometry import Affine
from webmap.ros.bridge import Bridge
from webmap.scope import keep
from webmap.tf import TransformError

PERIOD = 0.05
"""Least seconds between two moves of markers that move with their frames."""

Put = Callable[[Affine], object]
"""Puts a marker where its frame is now."""


@dataclass(slots=True)
class _Moving:
    frame: str
    stamp: float
    locked: bool
    put: Put


class MarkerFrames:
    """Tells where the frames of markers are on the map, and which of them move.

    Frames are only heard once a marker names one that is not the map's.

    Args:
        layer: The markers; it lies on the common map as the bridge is aligned.
        bridge: The link to the ROS system.
        map_frame: The map's own frame; None if markers are drawn as they come.
        namespace: ``/robot_0`` where the topics are ``/robot_0/tf`` and
            ``/robot_0/tf_static``.

    """

    def __init__(
        self, layer: Layer, bridge: Bridge, map_frame: str | None, namespace: str
    ) -> None:
        self._layer = layer
        self._bridge = bridge
        self._map_frame = map_frame
        self._namespace = namespace
        self._frames: Frames | None = None
        self._moving: dict[object, _Moving] = {}
        self._lost: dict[str, str] = {}
        self._lasting = Lasting()
        self._moved_at = -1.0
        layer.svg.set("data-bridge", alignments.mark(bridge))
        with layer.scope.active():
            keep(alignments.on_change(bridge, self._align))
        self._align()

    def place(
        self, key: object, frame_id: str, stamp: float, locked: bool, put: Put
    ) -> Affine:
        """Return what takes coordinates of a marker's frame to those of the map.

        Args:
            key: Of the marker.
            frame_id: Its frame; empty if it does not say.
            stamp: When the frame is meant, in seconds of the robot's clock; 0 for now.
            locked: Whether the marker goes on moving with the frame.
            put: Called when the frame has moved, or is known at last.

        """
        self._moving.pop(key, None)
        if self._map_frame is None or not frame_id:
            return Affine()
        if self._frames is None:
            if frame_id.strip("/") == self._map_frame:
                return Affine()
            self._frames = frames_of(self._bridge, self._namespace)
            with self._layer.scope.active():
                keep(self._frames.join(self._news))
        source = self._frames.buffer.name(frame_id, self._namespace)
        stamp = 0.0 if locked else stamp
        found, settled = self._look(source, stamp)
        if locked or not settled:
            self._moving[key] = _Moving(source, stamp, locked, put)
        return found

    def forget(self, key: object) -> None:
        """Forget a marker that is gone."""
        self._moving.pop(key, None)

    def say(self) -> None:
        """Say which frames nobody tells of, or take that back."""
        needed = {moving.frame for moving in self._moving.values()}
        self._lost = {f: words for f, words in self._lost.items() if f in needed}
        if self._lasting.look("lost" if self._lost else ""):
            frame, words = next(iter(self._lost.items()))
            text = f"it is not known where {frame!r} is on the map: {words}"
            more = len(self._lost) - 1
            self._layer.set_problem(self, text + (f" (and {more} more)" * bool(more)))
        else:
            self._layer.clear_problem(self)

    def _news(self) -> None:
        now = time.monotonic()
        if not self._moving or now < self._moved_at + PERIOD:
            return
        self._moved_at = now
        places: dict[tuple[str, float], tuple[Affine, bool]] = {}
        for key, each in tuple(self._moving.items()):
            asked = (each.frame, each.stamp)
            if asked not in places:
                places[asked] = self._look(*asked)
            found, settled = places[asked]
            each.put(found)
            if settled and not each.locked:
                del self._moving[key]
        self.say()

    def _look(self, source: str, stamp: float) -> tuple[Affine, bool]:
        """Return a frame's place, and whether news would not change it."""
        if self._frames is None or self._map_frame is None:
            return Affine(), True
        buffer = self._frames.buffer
        target = buffer.name(self._map_frame, self._namespace)
        try:
            found, settled = newest_or_at(buffer, target, source, stamp)
        except TransformError as error:
            self._lost.setdefault(source, str(error))
            return Affine(), False
        self._lost.pop(source, None)
        return found.from_above, settled

    def _align(self) -> None:
        place = alignments.of(self._bridge)
        self._layer.svg.set_pose(place.x, place.y, place.yaw)
