"""Base class of layers that draw messages on maps, and the frames of their data."""

from typing import Any, ClassVar, Self

from webmap.base.geometry import Affine, Pose
from webmap.base.scope import keep
from webmap.core.map import Layer, Map
from webmap.core.registry import map_modules
from webmap.core.robot import Robot
from webmap.modules.layer_options import Seconds
from webmap.modules.placed import put
from webmap.modules.sighting import newest_or_at
from webmap.modules.topic_layer import LEVEL, TopicLayer, origin, short
from webmap.poses.alignment import alignments
from webmap.poses.frames import Frames, delayed_problem, frames_of
from webmap.poses.placing import ProblemDelay
from webmap.ros.bridge import Bridge
from webmap.ros.tf import Transform, TransformError

NEVER = 1e9
"""Age limit in seconds of a layer without one, so that it is never stale."""


class MapLayer(TopicLayer, Layer):
    """A drawing on maps of the messages of one topic.

    A subclass is declared with :func:`webmap.layer`. It makes its elements in
    :meth:`build` and changes them in :meth:`draw`; this class does the rest. It decodes
    the messages of the topic; an invalid message is skipped and shown as a problem on
    the maps. The whole layer is placed at the frame of the message at its stamp, with
    the alignment of the map. It is shown as stale when it is, and has a name in the
    list of layers. Maps that ask for the same layer with the same options share one,
    which ends with the last of them.

    Annotated attributes of the class that have a value are options of the module. A
    call of the class shows the layer on a map, and returns a :class:`ShownLayer`.
    """

    owner: ClassVar = "map"
    registry: ClassVar = map_modules

    age_limit: Seconds | None = None
    """Seconds after which it is drawn as stale; None for data that is sent only
    once."""

    map_frame: str | None = "map"
    """The map's own frame in the ``/tf`` of the bridge; None to draw data without a
    transform."""

    namespace: str = ""
    """``/robot_0`` if the frames are on ``/robot_0/tf``."""

    robot: Robot | None = None
    """The robot of the layer: it has the alignment of that robot, or of the bridge
    without a robot."""

    order: float | None = None
    """The drawing order: a greater one is drawn above; robots have 100, and the layer
    50 if not given."""

    usual_order = 50.0
    """The order if none is given."""

    def __new__(cls, map: Map, *args: Any, **options: Any) -> Any:
        """Return the module that shows the layer on a map."""
        return ShownLayer(map, cls, args, options)

    @classmethod
    def _made(cls, *args: Any, **options: Any) -> Self:
        layer = object.__new__(cls)
        Layer.__init__(layer)
        layer._take_arguments(None, *args, **options)
        return layer

    def start(self) -> None:
        """Make the drawing and subscribe; called once, in the layer's scope."""
        self.svg.classes.add(self.declared.css)
        self.svg.set(pointer_events="none")
        owner = "" if self.robot is None else self.robot.name
        self.svg.set("data-layer", short(self.topic, owner))
        self.lay()
        self.build()
        self._subscribe(self)

    def lay(self) -> None:
        """Put the layer on the common map; it moves with the frames of its data."""
        self.anchor = Anchored(
            self, self.bridge, self.map_frame, self.namespace, self.robot
        )

    def take(self, message: Any) -> None:
        """Draw a message at the pose of its frame at its stamp.

        Raises:
            ProtocolError: If it cannot be drawn.

        """
        found, at = self.read(message), origin(message)
        self.draw(found, LEVEL)  # before it is placed, since it may refuse the message
        self.anchor.stand_in(*at)
        self.be_new()

    def be_new(self) -> None:
        """Set the age of the drawing to that of the bridge's messages."""
        limit = NEVER if self.age_limit is None else self.age_limit
        self.svg.set_age(self.bridge.lag, limit=limit)


class ShownLayer:
    """A layer on one map: the module that the map has.

    Args:
        map: The map.
        layer: The class of the layer.
        args: The positional arguments after the map.
        options: The keyword arguments.

    """

    def __init__(
        self,
        map: Map,
        layer: type[MapLayer],
        args: tuple[Any, ...],
        options: dict[str, Any],
    ) -> None:
        given = layer.__signature__.bind(map, *args, **options)
        given.apply_defaults()
        named = {k: v for k, v in given.arguments.items() if k != layer.owner}
        order = named.pop("order")
        self.map = map
        self.layer = layer.shared(**named)
        """The layer; other maps may show it too."""
        usual = self.layer.usual_order
        self.layer.show_on(map, order=usual if order is None else order)


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
