"""Where a layer lies, and where the frames are that its data is in."""

from typing import TYPE_CHECKING

from webmap.base.geometry import Affine, Pose
from webmap.base.scope import keep
from webmap.core.layer import Layer
from webmap.modules.placed import put
from webmap.modules.sighting import newest_or_at
from webmap.poses.alignment import alignments
from webmap.poses.frames import Frames, frames_of, lasting
from webmap.poses.lasting import Lasting
from webmap.ros.bridge import Bridge
from webmap.ros.tf import Transform, TransformError

if TYPE_CHECKING:
    from webmap.core.robot import Robot


class LayerFrames:
    """Lays a layer onto the common map, and knows the frames of its data.

    It lies there as its robot is aligned, or as its bridge is if it is nobody's own.
    Frames are only heard once data names one that is not the map's. All of it ends with
    the layer.

    Args:
        layer: What is drawn.
        bridge: The link to the ROS system that has the data and the frames.
        map_frame: The map's own frame; None if data is drawn as it comes.
        namespace: ``/robot_0`` where the topics are ``/robot_0/tf`` and
            ``/robot_0/tf_static``.
        robot: Whose layer it is.

    """

    def __init__(
        self,
        layer: Layer,
        bridge: Bridge,
        map_frame: str | None,
        namespace: str,
        robot: "Robot | None" = None,
    ) -> None:
        self._layer = layer
        self._bridge = bridge
        self._map_frame = map_frame
        self._namespace = namespace
        self._robot = robot
        self._frames: Frames | None = None
        self._lasting = Lasting()
        self._aligned: Pose | None = None
        self._begin()
        with layer.scope.active():
            keep(alignments.on_change(bridge, self._look_at_alignment))
            if robot is None:
                layer.svg.set("data-bridge", alignments.mark(bridge))
            else:
                layer.svg.set("data-layer-of", robot.id)
                keep(robot.whereabouts.join(self._look_at_alignment))
        self._look_at_alignment()

    @property
    def alignment(self) -> Pose:
        """Where the map of the data lies on the common one."""
        own = None if self._robot is None else self._robot.whereabouts.own_alignment
        return alignments.of(self._bridge) if own is None else own

    def _source(self, frame_id: str) -> str | None:
        """Return the whole name of a frame; None if data of it is drawn as it comes."""
        if self._map_frame is None or not frame_id:
            return None
        if self._frames is None:
            if frame_id.strip("/") == self._map_frame:
                return None
            self._frames = frames_of(self._bridge, self._namespace)
            with self._layer.scope.active():
                keep(self._frames.join(self._news))
        return self._frames.buffer.name(frame_id, self._namespace)

    def _look(self, source: str, stamp: float) -> tuple[Transform, bool]:
        """Return what takes a frame to the map, and whether news would not change it.

        Raises:
            TransformError: If that is not known.

        """
        if self._frames is None or self._map_frame is None:
            return Transform(), True
        buffer = self._frames.buffer
        target = buffer.name(self._map_frame, self._namespace)
        return newest_or_at(buffer, target, source, stamp)

    def _say(self, words: str) -> None:
        """Show what is wrong with the frames once it has lasted, or clear it."""
        if lasting(self._lasting, "lost" if words else "", self._frames):
            self._layer.set_problem(self, words)
        elif not words:
            self._layer.clear_problem(self)

    def _look_at_alignment(self) -> None:
        aligned = self.alignment
        if aligned != self._aligned:
            self._aligned = aligned
            self._align(aligned)

    def _begin(self) -> None:
        """Make ready, before the layer is laid anywhere."""

    def _align(self, aligned: Pose) -> None:
        """Lay the layer where its map is now."""
        raise NotImplementedError

    def _news(self) -> None:
        """Look again where frames are."""
        raise NotImplementedError


def not_known(frame: str, why: object) -> str:
    """Return a sentence on a frame that is somewhere and nobody tells where."""
    return f"the pose of {frame!r} on the map is unknown: {why}"


class Anchored(LayerFrames):
    """Keeps a whole layer where the frames of a ROS system have its data."""

    def _begin(self) -> None:
        self._frame: str | None = None
        self._offset = Affine()

    def stand_in(self, frame_id: str, stamp: float) -> None:
        """Take the layer's coordinates to be in a frame, as it was at a time.

        Afterwards the layer moves as the frame does.

        Args:
            frame_id: The frame of a message; empty if it does not say.
            stamp: In seconds of the robot's clock; 0 if not said.

        """
        source = self._source(frame_id)
        if source is not None:
            self._frame = source
            self._place(source, stamp)

    def _news(self) -> None:
        if self._frame is not None:
            self._place(self._frame, 0.0)

    def _place(self, source: str, stamp: float) -> None:
        try:
            found, _ = self._look(source, stamp)
        except TransformError as error:
            self._say(not_known(source, error))
            return
        self._offset = found.from_above
        self._align(self.alignment)
        self._say("")

    def _align(self, aligned: Pose) -> None:
        put(self._layer.svg, Affine.of_pose(aligned) @ self._offset)
