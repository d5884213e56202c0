"""The declaration of a layer: its topics, its switch and its CSS class.

Discovery, the limit of layers per robot, the list of layers on the page,
``webmap view --show`` and the reference are derived from it.
"""

import inspect
import logging
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from typing import Any, TypeVar

import msgspec

from webmap.base.errors import ConfigError
from webmap.core.registry import Namespace, map_modules, robot_modules
from webmap.ros.names import same_type, split_type

log = logging.getLogger("webmap.modules")

T = TypeVar("T", bound=type)

View = type[msgspec.Struct]

BY_TYPE = {"": "its type alone"}

LAST = 1000.0
"""The rank of a layer without a rank: after the built-in ones."""


@dataclass(frozen=True, slots=True)
class TopicKind:
    """Topics that a layer draws in the same way."""

    name: str
    """The name of the kind in discovery, such as ``"scan"``. Kinds of a layer with the
    same name share their limit, and differ only in types and names."""

    names: Mapping[str, str] = field(default_factory=lambda: BY_TYPE)
    """Regular expressions that are searched in the topic's name, the best first, each
    with the reason that is shown to people."""

    most: int = 3
    """The greatest number of topics of this kind for one robot."""

    types: tuple[str, ...] = ()
    """The types of such topics, without a ROS version; all of the layer's if empty."""

    options: Mapping[str, Any] = field(default_factory=dict)
    """The layer's options for such a topic."""

    shared: bool = False
    """Whether a topic outside of every robot's namespace belongs to all robots."""

    role: str = ""
    """The role of such a topic in ``--set ROBOT.ROLE=TOPIC``, if it has one."""


@dataclass(frozen=True, slots=True)
class FoundTopic:
    """A topic that discovery found for a layer, and the robot that it belongs to."""

    kind: TopicKind
    topic: str
    type: str
    """As the bridge spells it."""

    own: bool = True
    """Whether the topic is in the robot's own namespace and not shared by robots."""

    namespace: str = ""
    """The namespace of the robot: ``/robot_0``, or empty."""

    frames: Mapping[str, Any] | None = None
    """``map_frame`` and ``namespace`` of the robot's TF; None if it has none."""

    number: int = 1
    """The number of this layer among the robot's layers of this class, from 1."""


@dataclass(frozen=True, slots=True)
class Declaration:
    """The arguments of :func:`layer` for one class."""

    layer: type
    types: tuple[str, ...]
    kinds: tuple[TopicKind, ...]
    view: View | Mapping[str, View] | None
    switches: Mapping[str, str]
    """CSS selectors by switch name."""

    css: str
    rank: float

    @property
    def name(self) -> str:
        """The name by which ``add_module`` adds the layer: that of its class."""
        return self.layer.__name__

    @property
    def built_in(self) -> bool:
        """Whether the layer comes with WebMap."""
        return self.layer.__module__.startswith("webmap.")

    @property
    def of_maps(self) -> bool:
        """Whether it is a layer of maps and not of robots."""
        return getattr(self.layer, "registry", robot_modules) is map_modules

    def options_for(self, found: FoundTopic) -> dict[str, Any]:
        """Return the options with which the layer draws a topic."""
        chosen = getattr(self.layer, "options_for", None)
        options: dict[str, Any] = (
            usual_options(self.layer, found) if chosen is None else chosen(found)
        )
        return options

    def view_of(self, type: str) -> View | None:
        """Return the class for decoding messages of a type; None for plain messages.

        Raises:
            ConfigError: If the layer does not draw messages of that type.

        """
        plain = str(split_type(type))
        if plain not in self.types:
            raise ConfigError(f"type is one of {', '.join(self.types)}, got {type!r}")
        return self.view[plain] if isinstance(self.view, Mapping) else self.view


def usual_options(layer: type, found: FoundTopic) -> dict[str, Any]:
    """Return the options of a topic's kind, and those that depend on the topic.

    An option ``type`` gets the topic's type if it is not the default one. An option
    ``map_frame`` gets the frames of the robot.

    Args:
        layer: The class of the layer.
        found: The topic.

    """
    options = dict(found.kind.options)
    takes = inspect.signature(layer).parameters
    if "type" in takes and not same_type(found.type, takes["type"].default):
        options["type"] = found.type
    everybodys = found.kind.shared and not found.own
    if "map_frame" in takes and found.frames is not None and not everybodys:
        options |= {key: found.frames[key] for key in ("map_frame", "namespace")}
    return options


def layer(
    *types: str,
    kinds: Iterable[TopicKind] = (),
    kind: str = "",
    names: str = "",
    most: int = 3,
    view: View | Mapping[str, View] | None = None,
    switch: str | Mapping[str, str] = "",
    css: str = "",
    rank: float = LAST,
) -> Callable[[T], T]:
    """Declare what a layer draws, so that discovery finds its topics (decorator).

    A subclass of :class:`webmap.RobotLayer` or :class:`webmap.MapLayer` is registered
    as a module under its own name; any other class must be registered separately.

    Args:
        *types: Message types that the layer draws, without a ROS version, such as
            ``"sensor_msgs/Temperature"``; the first is the default one.
        kinds: The kinds of topics that discovery draws with it, the best first.
        kind: The name of the only kind. Without it and ``kinds``, only programs add the
            layer.
        names: A regular expression that is searched in the names of topics of the only
            kind; all topics of the types if empty.
        most: The greatest number of topics of the only kind for one robot.
        view: A class for decoding messages, or one for each type. Without it, a message
            is decoded to an object with all fields as attributes.
        switch: The name of its switch in the list of layers, or CSS selectors by switch
            name.
        css: The CSS class of the drawing; the name of the layer in lower case if empty.
        rank: The order in which layers are found and drawn; the built-in ones have
            multiples of 10, and a new one takes the next that is free.

    Raises:
        ConfigError: If there is no type or one is no name of a type, if both ``kind``
            and ``kinds`` are given, or if a kind has a pattern that is no regular
            expression, an option that the layer does not take, or the name of another
            kind with another limit, role or options.

    """
    if not types or not all(isinstance(type, str) for type in types):
        raise ConfigError(
            f"a layer draws messages of one type or more, as in "
            f'@layer("sensor_msgs/Temperature"); got {types}'
        )
    if kind and kinds:
        raise ConfigError(f"a layer takes kind or kinds, got {kind!r} and {kinds}")
    if kind:
        why = {names: "its type and its name"} if names else BY_TYPE
        kinds = (TopicKind(kind, why, most),)
    plain = tuple(str(split_type(type)) for type in types)

    def declare(made: T) -> T:
        selector = f".{css or made.__name__.lower()}"
        declaration = Declaration(
            made,
            plain,
            tuple(replace(each, types=each.types or plain) for each in kinds),
            view,
            {switch: selector} if isinstance(switch, str) else switch,
            selector[1:],
            rank,
        )
        setattr(made, "declared", declaration)  # noqa: B010
        _check_kinds(declaration)
        registry = getattr(made, "registry", None)
        if isinstance(registry, Namespace):
            registry.register(made)
        return made

    return declare


def _check_kinds(declared: Declaration) -> None:
    """Check that discovery can use all kinds."""
    takes = list(inspect.signature(declared.layer).parameters)
    first: dict[str, TopicKind] = {}
    for kind in declared.kinds:
        where = f"layer {declared.name}, kind {kind.name!r}"
        same = first.setdefault(kind.name, kind)
        if replace(kind, names=same.names, types=same.types) != same:
            raise ConfigError(
                f"{where}: kinds of one name must only differ in types and names"
            )
        for pattern in kind.names:
            try:
                re.compile(pattern)
            except re.error as error:
                raise ConfigError(
                    f"{where}: {pattern!r} is not a regular expression: {error}"
                ) from error
        for option in kind.options:
            if option not in takes:
                raise ConfigError(
                    f"{where}: there is no option {option!r}; the layer takes "
                    f"{', '.join(takes)}"
                )


def declarations() -> list[Declaration]:
    """Return the declarations of all layers, ordered by rank.

    A kind whose name an earlier layer already has is left out, and logged once.
    """
    made = [*robot_modules, *map_modules]
    return list(_declared(tuple(each for each in made if isinstance(each, type))))


@lru_cache(maxsize=1)
def _declared(made: tuple[type, ...]) -> list[Declaration]:
    found = (vars(each).get("declared") for each in made)
    declared = {id(each): each for each in found if isinstance(each, Declaration)}
    ordered = sorted(declared.values(), key=lambda each: each.rank)
    first: dict[str, Declaration] = {}
    for each in ordered:
        for kind in each.kinds:
            first.setdefault(kind.name, each)
    return [_without_taken_kinds(each, first) for each in ordered]


def _without_taken_kinds(
    declared: Declaration, first: Mapping[str, Declaration]
) -> Declaration:
    kinds = tuple(kind for kind in declared.kinds if first[kind.name] is declared)
    if len(kinds) == len(declared.kinds):
        return declared
    for kind in declared.kinds:
        if kind not in kinds:
            _warn(
                f"the layer {declared.name} has a kind {kind.name!r}, as "
                f"{first[kind.name].name} has; give it another name. Discovery does "
                f"not use it."
            )
    return replace(declared, kinds=kinds)


@cache
def _warn(text: str) -> None:
    log.warning("%s", text)
