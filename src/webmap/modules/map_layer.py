"""Base class of layers that draw the messages of one topic on maps."""

from typing import Any, ClassVar, Self

from webmap.core.layer import Layer
from webmap.core.map import Map
from webmap.core.registry import map_modules
from webmap.core.robot import Robot
from webmap.modules.layer_frames import Anchored
from webmap.modules.layer_options import Seconds
from webmap.modules.topic_layer import LEVEL, TopicLayer, origin, short

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
