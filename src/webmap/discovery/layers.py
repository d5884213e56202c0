"""Which topics can be drawn on a map besides what a robot is driven by.

Rules are looked at in order, and the first that fits a topic counts. A robot gets so
many topics of a kind at the most, the best first, since each costs its link something.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

from webmap.discovery.grouping import nearest
from webmap.errors import ConfigError
from webmap.ros.names import is_topic, split_type

Kind: TypeAlias = Literal[
    "costmap",
    "cloud",
    "local plan",
    "particles",
    "doubt",
    "footprint",
    "range",
    "markers",
    "fix",
    "health",
]
"""What is drawn of a topic."""


@dataclass(frozen=True, slots=True)
class LayerRule:
    """One rule."""

    kind: Kind
    types: tuple[str, ...]
    """Names of types without a dialect."""

    name: str
    """A pattern that is found in the topic's name."""

    most: int
    """How many topics of this kind a robot gets."""


@dataclass(frozen=True, slots=True)
class FoundLayer:
    """A topic that can be drawn."""

    kind: Kind
    topic: str
    type: str
    """The type as the bridge spells it."""


POLYGON = ("geometry_msgs/PolygonStamped",)

RULES: tuple[LayerRule, ...] = (
    LayerRule("costmap", ("nav_msgs/OccupancyGrid",), r"local_costmap/costmap\Z", 1),
    LayerRule("costmap", ("nav_msgs/OccupancyGrid",), r"costmap/costmap\Z", 1),
    LayerRule("cloud", ("sensor_msgs/PointCloud2",), r"points|cloud", 2),
    LayerRule("local plan", ("nav_msgs/Path",), r"/local_plan\Z", 1),
    LayerRule(
        "particles",
        ("geometry_msgs/PoseArray", "nav2_msgs/ParticleCloud"),
        r"particle_?cloud\Z",
        1,
    ),
    LayerRule(
        "doubt",
        ("geometry_msgs/PoseWithCovarianceStamped",),
        r"/(?:amcl_pose|localization_pose|pose)\Z",
        1,
    ),
    LayerRule("footprint", POLYGON, r"local_costmap/(?:published_)?footprint\Z", 1),
    LayerRule("footprint", POLYGON, r"footprint\Z", 1),
    LayerRule("range", ("sensor_msgs/Range",), r"", 8),
    LayerRule("markers", ("visualization_msgs/MarkerArray",), r"", 3),
    LayerRule("markers", ("visualization_msgs/Marker",), r"", 3),
    LayerRule("fix", ("sensor_msgs/NavSatFix",), r"(?:\A|/)fix\Z", 1),
    LayerRule("fix", ("sensor_msgs/NavSatFix",), r"", 1),
    LayerRule("health", ("diagnostic_msgs/DiagnosticArray",), r"/diagnostics\Z", 1),
)


def find_layers(
    topics: Mapping[str, str], robots: Iterable[str]
) -> dict[str, list[FoundLayer]]:
    """Return what can be drawn of each robot.

    Args:
        topics: Types by topic, in either dialect.
        robots: The namespaces of the robots behind the bridge: ``/robot_0``, or empty
            for a robot without one.

    """
    spaces = list(robots)
    matched: dict[str, list[tuple[int, str, FoundLayer]]] = {
        space: [] for space in spaces
    }
    for topic, type in topics.items():
        found = _match(topic, type)
        if found is None:
            continue
        place, layer = found
        for space in _owners(topic, layer.kind, matched):
            matched[space].append((place, topic, layer))
    return {space: _best(layers) for space, layers in matched.items()}


def _match(topic: str, type: str) -> tuple[int, FoundLayer] | None:
    if not is_topic(topic):
        return None
    try:
        plain = str(split_type(type.strip()))
    except ConfigError:
        return None
    for place, rule in enumerate(RULES):
        if plain in rule.types and re.search(rule.name, topic):
            return place, FoundLayer(rule.kind, topic, type.strip())
    return None


def _owners(topic: str, kind: Kind, spaces: Mapping[str, object]) -> list[str]:
    """Return whose a topic is: the innermost robot's, or the only one's."""
    owner = nearest(topic, spaces)
    if owner is not None:
        return [owner]
    if kind == "health" or len(spaces) == 1:
        return list(spaces)
    return []


def _best(found: list[tuple[int, str, FoundLayer]]) -> list[FoundLayer]:
    best: list[FoundLayer] = []
    for place, _, layer in sorted(found, key=lambda each: each[:2]):
        if sum(other.kind == layer.kind for other in best) < RULES[place].most:
            best.append(layer)
    return best
