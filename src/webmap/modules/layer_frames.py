"""The alignment of a layer, and the frames of its data."""

from webmap.base.geometry import Affine, Pose
from webmap.base.scope import keep
from webmap.core.layer import Layer
from webmap.core.robot import Robot
from webmap.modules.placed import put
from webmap.modules.sighting import newest_or_at
from webmap.poses.alignment import alignments
from webmap.poses.frames import Frames, delayed_problem, frames_of
from webmap.poses.placing import ProblemDelay
from webmap.ros.bridge import Bridge
from webmap.ros.tf import Transform, TransformError


class LayerFrames:
    """Puts a layer on the common map, and receives the frames of its data.

    The layer has the alignment of its robot, or of its bridge if the robot has none. TF
    is only subscribed to once data names a frame other than the map's. All of it ends
    with the layer.

    Args:
        layer: The layer.
        bridge: The connection to the ROS system that has the data and the frames.
        map_frame: The map's own frame; None to draw data without a transform.
        namespace: ``/robot_0`` if the topics are ``/robot_0/tf`` and
            ``/robot_0/tf_static``.
        robot: The robot of the layer, if it has one.

    """

    def __init__(
        self,
        layer: Layer,
        bridge: Bridge,
        map_frame: str | None,
        namespace: str,
        robot: Robot | None = None,
    ) -> None:
        self._layer = layer
        self._bridge = bridge
        self._map_frame = map_frame
        self._namespace = namespace
        self._robot = robot
        self._frames: Frames | None = None
        self._problem_delay = ProblemDelay()
        self._aligned: Pose | None = None
        self._begin()
        with layer.scope.active():
            keep(alignments.on_change(bridge, self._look_at_alignment))
            if robot is None:
                layer.svg.set("data-bridge", alignments.mark(bridge))
            else:
                layer.svg.set("data-layer-of", robot.id)
                keep(robot.pose_source.join(self._look_at_alignment))
        self._look_at_alignment()

    @property
    def alignment(self) -> Pose:
        """The position and rotation of the data's map on the common one."""
        own = None if self._robot is None else self._robot.pose_source.own_alignment
        return alignments.of(self._bridge) if own is None else own

    def _source(self, frame_id: str) -> str | None:
        """Return the full name of a frame; None to draw data without a transform."""
        if self._map_frame is None or not frame_id:
            return None
        if self._frames is None:
            if frame_id.strip("/") == self._map_frame:
                return None
            self._frames = frames_of(self._bridge, self._namespace)
            with self._layer.scope.active():
                keep(self._frames.join(self._on_frames))
        return self._frames.buffer.name(frame_id, self._namespace)

    def _look(self, source: str, stamp: float) -> tuple[Transform, bool]:
        """Return the transform from a frame to the map, and whether it is final.

        Raises:
            TransformError: If the transform is unknown.

        """
        if self._frames is None or self._map_frame is None:
            return Transform(), True
        buffer = self._frames.buffer
        target = buffer.name(self._map_frame, self._namespace)
        return newest_or_at(buffer, target, source, stamp)

    def _show_trouble(self, text: str) -> None:
        """Show a problem of the frames once it has lasted, or clear it."""
        if delayed_problem(self._problem_delay, "lost" if text else "", self._frames):
            self._layer.set_problem(self, text)
        elif not text:
            self._layer.clear_problem(self)

    def _look_at_alignment(self) -> None:
        aligned = self.alignment
        if aligned != self._aligned:
            self._aligned = aligned
            self._align(aligned)

    def _begin(self) -> None:
        """Set attributes before the layer is first placed."""

    def _align(self, aligned: Pose) -> None:
        """Place the layer at the current alignment of its map."""
        raise NotImplementedError

    def _on_frames(self) -> None:
        """Draw by the new frames; each subclass implements this."""
        raise NotImplementedError


def not_known(frame: str, why: object) -> str:
    """Return the sentence for a frame whose pose is unknown."""
    return f"the pose of {frame!r} on the map is unknown: {why}"


class Anchored(LayerFrames):
    """Keeps a whole layer at the frame of its data."""

    def _begin(self) -> None:
        self._frame: str | None = None
        self._offset = Affine()

    def stand_in(self, frame_id: str, stamp: float) -> None:
        """Set the frame of the layer's coordinates, as it was at a time.

        Afterwards the layer moves with the frame.

        Args:
            frame_id: The frame of a message; empty if it has none.
            stamp: In seconds of the robot's clock; 0 if there is none.

        """
        source = self._source(frame_id)
        if source is not None:
            self._frame = source
            self._place(source, stamp)

    @property
    def place(self) -> Affine:
        """The transform from the layer's coordinates to the common map."""
        return Affine.of_pose(self.alignment) @ self._offset

    def _on_frames(self) -> None:
        if self._frame is not None:
            self._place(self._frame, 0.0)

    def _place(self, source: str, stamp: float) -> None:
        try:
            found, _ = self._look(source, stamp)
        except TransformError as error:
            self._show_trouble(not_known(source, error))
            return
        self._offset = found.from_above
        self._align(self.alignment)
        self._show_trouble("")

    def _align(self, aligned: Pose) -> None:
        put(self._layer.svg, Affine.of_pose(aligned) @ self._offset)
