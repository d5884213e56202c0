"""Where a layer lies whose data is in another frame than the map's."""

from webmap.core.alignment import alignments
from webmap.core.frames import Frames, frames_of
from webmap.core.layer import Layer
from webmap.geometry import Pose
from webmap.ros.bridge import Bridge
from webmap.scope import keep
from webmap.tf import NotKnownThen, TransformError


class Anchored:
    """Keeps a layer where the frames of a ROS system have its data.

    The layer lies on the common map as the bridge is aligned. Frames are only heard
    once a message names one that is not the map's. It ends with the layer.

    Args:
        layer: What is moved, whole.
        bridge: The link to the ROS system that has the frames.
        map_frame: The map's own frame; None if data is drawn as it comes.
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
        self._frame = ""
        self._frames: Frames | None = None
        self._offset = Pose()
        layer.svg.set("data-bridge", alignments.mark(bridge))
        with layer.scope.active():
            keep(alignments.on_change(bridge, self._put))
        self._put()

    def stand_in(self, frame_id: str, stamp: float) -> None:
        """Take the layer's coordinates to be in a frame, as it was at a time.

        Afterwards the layer moves as the frame does.

        Args:
            frame_id: The frame of a message; empty if it does not say.
            stamp: In seconds of the robot's clock; 0 if not said.

        """
        if self._map_frame is None or not frame_id:
            return
        if self._frames is None:
            if frame_id.strip("/") == self._map_frame:
                return
            self._frames = frames_of(self._bridge, self._namespace)
            with self._layer.scope.active():
                keep(self._frames.join(self._moved))
        self._frame = self._frames.buffer.name(frame_id, self._namespace)
        self._place(stamp)

    def _moved(self) -> None:
        self._place(0.0)

    def _place(self, stamp: float) -> None:
        if self._frames is None or self._map_frame is None:
            return
        buffer = self._frames.buffer
        target = buffer.name(self._map_frame, self._namespace)
        try:
            if self._frame == target:
                pose = Pose()
            else:
                try:
                    found = buffer.lookup(target, self._frame, stamp or None)
                except NotKnownThen:
                    found = buffer.lookup(target, self._frame)
                pose = found.planar
        except TransformError as error:
            text = f"it is not known where {self._frame!r} is on the map: {error}"
            self._layer.set_problem(self, text)
            return
        self._offset = pose
        self._put()
        self._layer.clear_problem(self)

    def _put(self) -> None:
        place = alignments.of(self._bridge) @ self._offset
        self._layer.svg.set_pose(place.x, place.y, place.yaw)
