"""Where markers are: each in the frame that it names itself."""

from collections.abc import Callable
from dataclasses import dataclass

from webmap.core.layer_frames import LayerFrames, not_known
from webmap.geometry import Pose
from webmap.tf import Transform, TransformError

Put = Callable[[Transform], object]
"""Puts a marker where its frame is now."""


@dataclass(slots=True)
class _Moving:
    frame: str
    stamp: float
    locked: bool
    put: Put


class MarkerFrames(LayerFrames):
    """Tells where the frames of markers are on the map, and which of them move."""

    def _begin(self) -> None:
        self._moving: dict[object, _Moving] = {}
        self._lost: dict[str, str] = {}

    def place(
        self, key: object, frame_id: str, stamp: float, locked: bool, put: Put
    ) -> Transform:
        """Return what takes coordinates of a marker's frame to those of the map.

        Args:
            key: Of the marker.
            frame_id: Its frame; empty if it does not say.
            stamp: When the frame is meant, in seconds of the robot's clock; 0 for now.
            locked: Whether the marker goes on moving with the frame.
            put: Called when the frame has moved, or is known at last.

        """
        self._moving.pop(key, None)
        source = self._source(frame_id)
        if source is None:
            return Transform()
        stamp = 0.0 if locked else stamp
        found, settled = self._find(source, stamp)
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
        words = ""
        if self._lost:
            frame, why = next(iter(self._lost.items()))
            more = len(self._lost) - 1
            words = not_known(frame, why) + f" (and {more} more)" * bool(more)
        self._say(words)

    def _news(self) -> None:
        if not self._moving:
            return
        places: dict[tuple[str, float], tuple[Transform, bool]] = {}
        for key, each in tuple(self._moving.items()):
            asked = (each.frame, each.stamp)
            if asked not in places:
                places[asked] = self._find(*asked)
            found, settled = places[asked]
            each.put(found)
            if settled and not each.locked:
                self.forget(key)
        self.say()

    def _find(self, source: str, stamp: float) -> tuple[Transform, bool]:
        """Return where a frame is, and whether news would not change that."""
        try:
            found = self._look(source, stamp)
        except TransformError as error:
            if source not in self._lost:
                self._lost[source] = str(error)
            return Transform(), False
        self._lost.pop(source, None)
        return found

    def _align(self, aligned: Pose) -> None:
        self._layer.svg.set_pose(aligned.x, aligned.y, aligned.yaw)
