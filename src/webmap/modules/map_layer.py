"""The base of what is drawn on maps from the messages of one topic."""

from typing import TYPE_CHECKING, Any, ClassVar, Self

from webmap.core.layer import Layer
from webmap.core.registry import map_modules
from webmap.modules.layer_frames import Anchored
from webmap.modules.layer_options import Seconds
from webmap.modules.topic_layer import LEVEL, TopicLayer, origin, short

if TYPE_CHECKING:
    from webmap.core.map import Map
    from webmap.core.robot import Robot

NEVER = 1e9
"""Seconds after which a layer without an age limit is drawn as old."""


class MapLayer(TopicLayer, Layer):
    """Something drawn on maps from the messages of one topic.

    A subclass is declared with :func:`webmap.layer`. It makes its elements in
    :meth:`build` and changes them in :meth:`draw`; everything else is done here. The
    messages of the topic are decoded, and one that makes no sense is left out and
    shown as a problem on the maps. The layer lies as a whole where the frame of the
    message was at its stamp, as the map is aligned, looks old when it is, and has a
    name in the list of layers. Maps that ask for the same layer with the same options
    share one, which ends with the last of them.

    Annotated attributes of the class that have a value are options of the module. A
    call of the class shows the layer on a map, and returns a :class:`ShownLayer`.
    """

    owner: ClassVar = "map"
    registry: ClassVar = map_modules

    age_limit: Seconds | None = None
    """Seconds after which it is drawn as old; None for data that is sent only once."""

    map_frame: str | None = "map"
    """The map's own frame, to which the ``/tf`` of the bridge leads; None to draw data
    as it comes."""

    namespace: str = ""
    """``/robot_0`` where the frames are on ``/robot_0/tf``."""

    robot: "Robot | None" = None
    """Whose layer it is: it lies as that robot is aligned, and as its bridge is if it
    is nobody's own."""

    order: float | None = None
    """What lies over what: greater is nearer; robots have 100, and the layer 50 if not
    given."""

    usual_order = 50.0
    """The order if none is given."""

    def __new__(cls, map: "Map", *args: Any, **options: Any) -> Any:
        """Return what shows the layer on a map."""
        return ShownLayer(map, cls, args, options)

    @classmethod
    def _made(cls, *args: Any, **options: Any) -> Self:
        layer = object.__new__(cls)
        Layer.__init__(layer)
        layer._take_arguments(None, *args, **options)
        return layer

    def start(self) -> None:
        """Make the drawing, and subscribe; called once, in the layer's scope."""
        self.svg.classes.add(self.declared.css)
        self.svg.set(pointer_events="none")
        owner = "" if self.robot is None else self.robot.name
        self.svg.set("data-layer", short(self.topic, owner))
        self.lay()
        self.build()
        self._subscribe(self)

    def lay(self) -> None:
        """Lay the layer onto the common map, to move with the frames of its data."""
        self.anchor = Anchored(
            self, self.bridge, self.map_frame, self.namespace, self.robot
        )

    def take(self, message: Any) -> None:
        """Draw a message where its frame was at its stamp.

        Raises:
            ProtocolError: If it cannot be drawn.

        """
        found, at = self.read(message), origin(message)
        self.draw(found, LEVEL)  # before it is placed, since it may refuse the message
        self.anchor.stand_in(*at)
        self.be_new()

    def be_new(self) -> None:
        """Note that the drawing is as new as the messages of the bridge."""
        limit = NEVER if self.age_limit is None else self.age_limit
        self.svg.set_age(self.bridge.lag, limit=limit)


class ShownLayer:
    """A layer on one map: the module that the map has.

    Args:
        map: The map.
        layer: The class of the layer.
        args: What it takes after the map.
        options: Its arguments by name.

    """

    def __init__(
        self,
        map: "Map",
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
        """The layer, which other maps may show too."""
        usual = self.layer.usual_order
        self.layer.show_on(map, order=usual if order is None else order)
