"""Common base class of layers of robots and maps: draws the messages of a topic."""

import math
from array import array
from collections.abc import Mapping
from functools import partial
from typing import Any, ClassVar, TypeVar

import msgspec

from webmap.base.audience import RARELY
from webmap.base.errors import ConfigError, ProtocolError
from webmap.base.geometry import FARTHEST
from webmap.base.processes import load_soon
from webmap.core.problems import MessageProblems, ProblemOwner
from webmap.core.registry import Namespace
from webmap.core.robot import Robot
from webmap.modules.declaration import Declaration, FoundTopic, usual_options
from webmap.modules.layer_options import LayerOptions
from webmap.ros.bridge import Bridge
from webmap.ros.decoding import convert
from webmap.ros.messages import Header
from webmap.ros.subscriptions import Encoding
from webmap.ros.tf import Transform
from webmap.scene.element import Element


def label(drawn: Element, topic: str, robot: Robot) -> None:
    """Name the topic of a drawing, so that viewers can switch the drawing on and off.

    Similar robots are switched together, so the robot's own namespace is left out:
    ``/bob/front/scan`` of Bob is ``front/scan``.

    Args:
        drawn: The element that has the class of its layer.
        topic: The topic of the drawing.
        robot: The robot of the drawing.

    """
    drawn.set("data-layer", short(topic, robot.name))


def short(topic: str, name: str) -> str:
    """Return a topic without the namespace of a robot of that name.

    The name of its agent or its bridge may follow that of the robot, in brackets.
    """
    first, _, rest = topic.strip("/").partition("/")
    own = rest and first.casefold() == name.partition(" (")[0].strip().casefold()
    return rest if own else f"/{topic.strip('/')}"


class MissingField(ProtocolError, AttributeError):
    """A message lacks a field."""


class LayerMessage:
    """A message whose fields are attributes; fields that cannot be drawn are refused.

    Args:
        fields: The decoded fields.

    """

    __slots__ = ("_fields",)

    def __init__(self, fields: Mapping[str, Any]) -> None:
        self._fields = fields

    @property
    def frame_id(self) -> str:
        """The frame of the numbers; empty if the message has none.

        If the header names none, it is the frame of the first part of a list.
        """
        lists = (each for each in self._fields.values() if isinstance(each, list))
        firsts = (each[0] for each in lists if each and isinstance(each[0], dict))
        frames = (LayerMessage(each).frame_id for each in firsts if "header" in each)
        return self._header.frame_id or next(filter(None, frames), "")

    @property
    def stamp(self) -> float:
        """The time of measurement by the robot's clock, in seconds; 0 if unknown."""
        return self._header.stamp.seconds

    @property
    def _header(self) -> Header:
        """The header; for a header, or without one, the message's own fields."""
        found = self._fields.get("header")
        if found is None:
            kinds = {"frame_id": str, "stamp": dict}
            own = ((name, self._fields.get(name), kinds[name]) for name in kinds)
            found = {name: each for name, each, kind in own if isinstance(each, kind)}
        header: Header = convert(found, Header)
        return header

    def __getattr__(self, name: str) -> Any:
        if name not in self._fields:
            known = ", ".join(self._fields) or "none"
            raise MissingField(f"the message has no field {name!r}; there are: {known}")
        return _usable(self._fields[name], name)


def _usable(value: Any, name: str) -> Any:
    """Return a field that can be drawn; its own fields are attributes."""
    if isinstance(value, dict):
        return LayerMessage(value)
    if isinstance(value, list):
        return [_usable(item, name) for item in value]
    check_numbers(value, name)
    return value


def origin(message: Any) -> tuple[str, float]:
    """Return the frame and the stamp of a message; empty and 0 without a header."""
    return getattr(message, "frame_id", ""), getattr(message, "stamp", 0.0)


def check_numbers(value: Any, name: str = "a number") -> None:
    """Check that the numbers of a message can be drawn.

    Args:
        value: A view of a message, or a part of one.
        name: The name of the part.

    Raises:
        ProtocolError: If a number is NaN, infinite or null, or a coordinate is too far
            away.

    """
    if isinstance(value, msgspec.Struct):
        for field in value.__struct_fields__:
            if field != "header":
                check_numbers(getattr(value, field), field)
    elif isinstance(value, list | tuple):
        for item in value:
            check_numbers(item, name)
    elif isinstance(value, array):  # numbers of a binary encoding
        if not all(map(math.isfinite, value)):
            raise ProtocolError(f"{name} must be finite numbers")
    elif value is None or (isinstance(value, float) and not math.isfinite(value)):
        got = "null" if value is None else value
        raise ProtocolError(f"{name} must be a finite number, got {got}")
    elif name in ("x", "y", "z") and _is_far(value):
        raise ProtocolError(
            f"{name} must be within {FARTHEST:g} m of the origin, got {value:g}"
        )


def _is_far(value: Any) -> bool:
    return isinstance(value, int | float) and abs(value) > FARTHEST


LEVEL = Transform()

E = TypeVar("E", bound=Element)


class TopicLayer(LayerOptions):
    """Draws the messages of one topic, and refuses invalid ones."""

    registry: ClassVar[Namespace]
    declared: ClassVar[Declaration]

    encoding: ClassVar[Encoding | None] = None
    """The encoding of messages, as in :meth:`webmap.Bridge.subscribe`."""

    queue_length: ClassVar[int] = 1
    """The number of messages that the bridge may queue."""

    only_draws: ClassVar[bool] = False
    """Whether the newest message is enough for the drawing and nothing else is done
    with the messages: while no page is open, they come every 5 s at most."""

    bridge: Bridge
    topic: str
    svg: Element
    """The group of the drawing."""

    # Layers with these options annotate them.
    type = ""
    throttle = 0

    def _take_arguments(self, *args: Any, **options: Any) -> None:
        if not hasattr(self, "declared"):
            name = self.__class__.__name__
            raise ConfigError(
                f"the layer {name} is not declared; write @webmap.layer("
                f'"package/Type") before the class'
            )
        super()._take_arguments(*args, **options)

    @classmethod
    def options_for(cls, found: FoundTopic) -> dict[str, Any]:
        """Return the options with which discovery adds the layer; may be replaced."""
        return usual_options(cls, found)

    def build(self) -> None:
        """Make the elements of the drawing; called once, after the options are set.

        Raises:
            ConfigError: If an option is not valid.

        """

    def add(self, element: E) -> E:
        """Append an element to the drawing, above the earlier ones, and return it."""
        self.svg.append(element)
        return element

    def read(self, message: Any) -> Any:
        """Return the data to draw of a message; called once for each message.

        Unless this is overridden, a message of a layer with a view is refused if a
        number in it is NaN or infinite, or a position is too far away. A message of a
        layer without a view is refused when such a number is used. A position is the
        fields x, y and z.

        Args:
            message: The message as decoded by the layer's view; nothing has been
                changed yet.

        Raises:
            ProtocolError: If the message cannot be drawn.

        """
        check_numbers(message)
        return message

    def draw(self, found: Any, at: Transform) -> None:
        """Replace the drawing.

        Args:
            found: The result of :meth:`read`.
            at: The transform from coordinates of the message to those of the drawing.

        """

    def take(self, message: Any) -> None:
        """Draw a message at the pose of its frame at its stamp.

        Raises:
            ProtocolError: If it cannot be drawn.

        """
        raise NotImplementedError

    def complain(self, text: str) -> None:
        """Show an error in a message that is drawn nevertheless."""
        self._refusing.complain(text)

    def _subscribe(self, owner: ProblemOwner) -> None:
        """Draw the messages of the topic; ``owner`` shows their errors."""
        self._refusing = MessageProblems(owner, self.topic)
        load_soon("numpy")  # most layers need it for their first message
        type = self.type or self.declared.types[0]
        view = self.declared.view_of(type)
        take = self.take if view is not None else self._take_plain
        self.bridge.subscribe(
            self.topic,
            partial(self._refusing.take, take),
            type,
            throttle=self.throttle,
            decode=view,
            encoding=self.encoding,
            queue_length=self.queue_length,
            unwatched=RARELY if self.only_draws else 0,
        )

    def _take_plain(self, message: Mapping[str, Any]) -> None:
        self.take(LayerMessage(message))
