"""Which topics can be drawn on a map besides those that are used for driving.

Layers declare which topics they draw. The first kind that fits a topic is used. The
number of topics of a kind is limited for each robot, the best first, because each
costs bandwidth.
"""

import inspect
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, TypeAlias

import msgspec

from webmap.base.errors import ConfigError
from webmap.config.robot import ModuleConfig, RobotConfig, is_link
from webmap.discovery.findings import FoundLayer, Layers
from webmap.discovery.rules import inside, nearest
from webmap.modules.declaration import Declaration, FoundTopic, TopicKind, declarations
from webmap.ros.names import is_topic, split_type

TRAIL = ModuleConfig(name="Trail", options={"length": 10.0})
"""The path of a robot in the past, drawn for every robot."""


RulePlace: TypeAlias = tuple[float, int, int, int]
"""The rank of a layer, and the indices of its kind, of the kind's type and pattern."""

RuleOrder: TypeAlias = tuple[RulePlace, bool, str]
"""The place of a rule, whether the topic is shared by robots, and the topic."""


def find_layers(topics: Mapping[str, str], robots: Iterable[str]) -> dict[str, Layers]:
    """Return the layers drawn and left out of each robot.

    Args:
        topics: Types by topic, in either dialect.
        robots: The namespaces of the robots behind the bridge: ``/robot_0``, or empty
            for a robot without one. A mapping has the robot of each part, too.

    """
    homes = robots if isinstance(robots, Mapping) else {name: name for name in robots}
    layers = declarations()
    kinds = _kinds(layers)
    layers = _foreign_first(layers)
    matched: dict[str, list[tuple[RuleOrder, FoundLayer]]]
    matched = {space: [] for space in homes.values()}
    for topic, type in topics.items():
        found = _match(topic, type, layers)
        if found is None:
            continue
        place, layer = found
        for space in _owners(topic, kinds[layer.kind][1], homes, matched):
            order = (place, not is_own(topic, space), topic)
            matched[space].append((order, layer))
    return {space: _best(found, kinds) for space, found in matched.items()}


def drawn_otherwise(topics: Mapping[str, str]) -> set[str]:
    """Return the topics that are drawn by layers from outside WebMap."""
    layers = _foreign_first(declarations())
    found = ((topic, _match(topic, type, layers)) for topic, type in topics.items())
    kinds = _kinds(layers)
    return {
        topic
        for topic, match in found
        if match is not None and not kinds[match[1].kind][0].built_in
    }


def is_own(topic: str, namespace: str) -> bool:
    """Return whether a topic belongs to one robot and is not shared."""
    return namespace != "" and inside(topic, namespace)


def role_of(layer: FoundLayer) -> str:
    """Return the role of the topics of such a layer; empty if none."""
    return declared_kind(layer.kind)[1].role


def declared_kind(name: str) -> tuple[Declaration, TopicKind]:
    """Return a kind of topics and the layer that draws them.

    Raises:
        ConfigError: If no layer has a kind of that name.

    """
    known = _kinds(declarations())
    if name not in known:
        raise ConfigError(f"no layer draws {name!r}; there are {', '.join(known)}")
    return known[name]


def _kinds(layers: Iterable[Declaration]) -> dict[str, tuple[Declaration, TopicKind]]:
    return {kind.name: (each, kind) for each in layers for kind in each.kinds}


def _foreign_first(layers: Iterable[Declaration]) -> list[Declaration]:
    """Return layers from outside WebMap before the built-in ones.

    They may draw some topics of a type better.
    """
    return sorted(layers, key=lambda each: each.built_in)


def _match(
    topic: str, type: str, layers: Iterable[Declaration]
) -> tuple[RulePlace, FoundLayer] | None:
    if not is_topic(topic):
        return None
    try:
        plain = str(split_type(type.strip()))
    except ConfigError:
        return None
    for declared in layers:
        for number, kind in enumerate(declared.kinds):
            if plain not in kind.types:
                continue
            for rule, (pattern, reason) in enumerate(kind.names.items()):
                if re.search(pattern, topic):
                    place = (declared.rank, number, kind.types.index(plain), rule)
                    return place, FoundLayer(kind.name, topic, type.strip(), reason)
    return None


def _owners(
    topic: str, kind: TopicKind, homes: Mapping[str, str], spaces: Collection[str]
) -> list[str]:
    """Return the owners of a topic: the innermost robot's, or the only robot's."""
    owner = nearest(topic, homes)
    if owner is not None:
        return [homes[owner]]
    if kind.shared or len(spaces) == 1:
        return list(spaces)
    return []


def _best(
    found: list[tuple[RuleOrder, FoundLayer]],
    kinds: Mapping[str, tuple[Declaration, TopicKind]],
) -> Layers:
    best: list[FoundLayer] = []
    others: list[FoundLayer] = []
    for _, layer in sorted(found, key=lambda each: each[0]):
        count = sum(other.kind == layer.kind for other in best)
        most = kinds[layer.kind][1].most
        (best if count < most else others).append(layer)
    return Layers(tuple(best), tuple(others))


@dataclass(frozen=True, slots=True)
class Drawing:
    """A module that draws one topic of a robot."""

    module: str
    """Its name; its first arguments are a bridge and the topic."""

    options: dict[str, Any] = field(default_factory=dict)
    of_maps: bool = False
    """Whether it is a module of maps, which a robot adds through ``OnMaps``."""

    shared: bool = False
    """Whether it belongs to no robot and is drawn once on the map for all robots."""


def drawing(
    layer: FoundLayer,
    namespace: str,
    frames: Mapping[str, Any] | None,
    number: int = 1,
) -> Drawing:
    """Return the module that draws a layer of a robot.

    Args:
        layer: The layer.
        namespace: The robot's namespace: ``/robot_0``, or empty.
        frames: ``map_frame`` and ``namespace`` of the robot's frames; None if it has
            none.
        number: Number of this layer among the robot's layers of this class, from 1.

    """
    declared, kind = declared_kind(layer.kind)
    own = is_own(layer.topic, namespace)
    found = FoundTopic(kind, layer.topic, layer.type, own, namespace, frames, number)
    options = declared.options_for(found)
    shared = declared.of_maps and kind.shared and not own
    return Drawing(declared.name, options, declared.of_maps and not shared, shared)


def topic_of(module: ModuleConfig) -> str:
    """Return the topic that a module draws; empty if it draws none."""
    for link, topic in pairwise(module.args):
        if is_link(link) and isinstance(topic, str):
            return topic
    return ""


def with_layers(
    config: RobotConfig, layers: Iterable[FoundLayer], namespace: str
) -> RobotConfig:
    """Return a robot with more layers, each topic once.

    Topics that robots share are left out.

    Args:
        config: The robot.
        layers: The layers to add.
        namespace: The robot's namespace: ``/robot_0``, or empty.

    """
    frames = None if config.tf is None else msgspec.structs.asdict(config.tf)
    scans, modules = list(config.scan), list(config.modules)
    # A battery is shown as a number: a layer may draw its topic too.
    drawn_now = (each.module for each in config.layers())
    taken = {topic_of(each) for each in drawn_now if each.name != "Battery"}
    if config.odometry is not None:
        taken.add(config.odometry.topic)
    for layer in layers:
        declared = declared_kind(layer.kind)[0]
        name = declared.name
        number = 1 + sum(module.name == name for module in modules)
        drawn = drawing(layer, namespace, frames, number)
        if drawn.shared or layer.topic in taken:
            continue
        taken.add(layer.topic)
        if drawn.module == "LaserScanner":
            scans.append(layer.topic)
            continue
        args = [{"bridge": config.bridge}, layer.topic]
        takes = inspect.signature(declared.layer).parameters
        options = {
            key: value
            for key, value in drawn.options.items()
            if value != "" or takes[key].default != ""
        }
        if drawn.of_maps:
            name, args = "OnMaps", [name, *args]
        modules.append(ModuleConfig(name=name, args=args, options=options))
    return msgspec.structs.replace(config, scan=scans, modules=modules)
