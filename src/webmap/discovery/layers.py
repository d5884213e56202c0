"""Which topics can be drawn on a map besides what a robot is driven by.

Rules are looked at in order, and the first that fits a topic counts. A robot gets so
many topics of a kind at the most, the best first, since each costs its link something.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

from webmap.discovery.grouping import inside, nearest
from webmap.errors import ConfigError
from webmap.ros.names import is_topic, split_type

Kind: TypeAlias = Literal[
    "map",
    "grid",
    "costmap",
    "global costmap",
    "scan",
    "cloud",
    "local plan",
    "path",
    "particles",
    "poses",
    "doubt",
    "footprint",
    "polygon",
    "goal",
    "pose",
    "lookahead",
    "point",
    "cells",
    "range",
    "markers",
    "fix",
    "health",
]
"""What is drawn of a topic."""

SHARED: tuple[Kind, ...] = ("map", "grid", "health")
"""What every robot has of a topic that is in nobody's namespace."""


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

    words: str
    """Why such a topic is drawn so, for people."""


@dataclass(frozen=True, slots=True)
class FoundLayer:
    """A topic that can be drawn."""

    kind: Kind
    topic: str
    type: str
    """The type as the bridge spells it."""

    rule: str = ""
    """The rule, in words."""


GRID = ("nav_msgs/OccupancyGrid",)
SCAN = ("sensor_msgs/LaserScan",)
CLOUD = ("sensor_msgs/PointCloud2",)
PATH = ("nav_msgs/Path",)
ARRAY = ("geometry_msgs/PoseArray",)
PARTICLES = ("nav2_msgs/ParticleCloud",)
DOUBT = ("geometry_msgs/PoseWithCovarianceStamped",)
POLYGON = ("geometry_msgs/PolygonStamped",)
POSE = ("geometry_msgs/PoseStamped",)
POINT = ("geometry_msgs/PointStamped",)
CELLS = ("nav_msgs/GridCells",)
MARKERS = ("visualization_msgs/MarkerArray",)
MARKER = ("visualization_msgs/Marker",)
FIX = ("sensor_msgs/NavSatFix",)
GPS_FIX = ("gps_msgs/GPSFix", "gps_common/GPSFix")
HEALTH = ("diagnostic_msgs/DiagnosticArray",)

RULES: tuple[LayerRule, ...] = (
    LayerRule("costmap", GRID, r"local_costmap/costmap\Z", 1, "a local costmap"),
    LayerRule(
        "global costmap", GRID, r"global_costmap/costmap\Z", 1, "a global costmap"
    ),
    LayerRule("costmap", GRID, r"costmap/costmap\Z", 1, "a costmap"),
    LayerRule("costmap", GRID, r"costmap", 1, "named a costmap"),
    LayerRule("map", GRID, r"/map\Z", 4, "the usual name"),
    LayerRule("map", GRID, r"map[^/]*\Z", 4, "named a map"),
    LayerRule("grid", GRID, r"", 2, "its type alone"),
    LayerRule("scan", SCAN, r"/(?:base_)?scan\Z", 6, "the usual name"),
    LayerRule("scan", SCAN, r"", 6, "its type alone"),
    LayerRule("cloud", CLOUD, r"points|cloud", 2, "named points or a cloud"),
    LayerRule("cloud", CLOUD, r"", 2, "its type alone"),
    LayerRule("local plan", PATH, r"/local_plan\Z", 1, "the usual name"),
    LayerRule("path", PATH, r"/plan\Z", 6, "the usual name"),
    LayerRule("path", PATH, r"plan|path|trajectory", 6, "named a way to go"),
    LayerRule("path", PATH, r"", 6, "its type alone"),
    LayerRule("particles", PARTICLES, r"", 1, "its type alone"),
    LayerRule("particles", ARRAY, r"particle_?cloud\Z", 1, "the usual name"),
    LayerRule("poses", ARRAY, r"", 3, "its type alone"),
    LayerRule(
        "doubt",
        DOUBT,
        r"/(?:amcl_pose|localization_pose|pose)\Z",
        2,
        "a localiser's pose",
    ),
    LayerRule(
        "doubt",
        DOUBT,
        r"\A(?!.*initial_?pose\Z)",
        2,
        "its type alone, unless it is where an initial pose is told",
    ),
    LayerRule(
        "footprint",
        POLYGON,
        r"local_costmap/(?:published_)?footprint\Z",
        1,
        "of a local costmap",
    ),
    LayerRule("footprint", POLYGON, r"footprint[^/]*\Z", 1, "named a footprint"),
    LayerRule("polygon", POLYGON, r"", 3, "its type alone"),
    LayerRule("goal", POSE, r"/current_goal\Z", 1, "where move_base says that it goes"),
    LayerRule("goal", POSE, r"/goal_pose\Z", 1, "where RViz sends Nav2"),
    LayerRule(
        "goal", POSE, r"/move_base_simple/goal\Z", 1, "where RViz sends move_base"
    ),
    LayerRule("pose", POSE, r"", 3, "its type alone"),
    LayerRule(
        "lookahead", POINT, r"/lookahead_point\Z", 1, "what a controller steers to"
    ),
    LayerRule("point", POINT, r"", 3, "its type alone"),
    LayerRule(
        "cells", CELLS, r"local_costmap/(?!unknown_space\Z)", 3, "of a local costmap"
    ),
    LayerRule(
        "cells",
        CELLS,
        r"\A(?!.*unknown_space\Z)",
        3,
        "its type alone, unless it is all that nobody knows",
    ),
    LayerRule("range", ("sensor_msgs/Range",), r"", 8, "its type alone"),
    LayerRule("markers", MARKERS, r"", 3, "its type alone"),
    LayerRule("markers", MARKER, r"", 3, "its type alone"),
    LayerRule("fix", FIX, r"/fix\Z", 1, "the usual name"),
    LayerRule("fix", FIX, r"", 1, "its type alone"),
    LayerRule("fix", GPS_FIX, r"", 1, "its type alone"),
    LayerRule("health", HEALTH, r"/diagnostics\Z", 1, "the usual name"),
    LayerRule("health", HEALTH, r"/diagnostics_agg\Z", 1, "what an aggregator says"),
)


Order: TypeAlias = tuple[int, bool, str]
"""The place of a rule, whether the topic is no robot's own, and the topic."""


def find_layers(
    topics: Mapping[str, str], robots: Iterable[str]
) -> dict[str, list[FoundLayer]]:
    """Return what is drawn of each robot.

    Args:
        topics: Types by topic, in either dialect.
        robots: The namespaces of the robots behind the bridge: ``/robot_0``, or empty
            for a robot without one.

    """
    return {space: drawn for space, (drawn, _) in _sorted(topics, robots).items()}


def left_out(
    topics: Mapping[str, str], robots: Iterable[str]
) -> dict[str, list[FoundLayer]]:
    """Return what could be drawn of each robot, but for its number.

    Args:
        topics: Types by topic, in either dialect.
        robots: The namespaces of the robots behind the bridge.

    """
    return {space: others for space, (_, others) in _sorted(topics, robots).items()}


def is_own(topic: str, namespace: str) -> bool:
    """Tell whether a map is a robot's own, and not the one that all of them share."""
    return namespace != "" and inside(topic, namespace)


def _sorted(
    topics: Mapping[str, str], robots: Iterable[str]
) -> dict[str, tuple[list[FoundLayer], list[FoundLayer]]]:
    matched: dict[str, list[tuple[Order, FoundLayer]]] = {space: [] for space in robots}
    for topic, type in topics.items():
        found = _match(topic, type)
        if found is None:
            continue
        place, layer = found
        for space in _owners(topic, layer.kind, matched):
            order = (place, not is_own(topic, space), topic)
            matched[space].append((order, layer))
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
            return place, FoundLayer(rule.kind, topic, type.strip(), rule.words)
    return None


def _owners(topic: str, kind: Kind, spaces: Mapping[str, object]) -> list[str]:
    """Return whose a topic is: the innermost robot's, or the only one's."""
    owner = nearest(topic, spaces)
    if owner is not None:
        return [owner]
    if kind in SHARED or len(spaces) == 1:
        return list(spaces)
    return []


def _best(
    found: list[tuple[Order, FoundLayer]],
) -> tuple[list[FoundLayer], list[FoundLayer]]:
    best: list[FoundLayer] = []
    others: list[FoundLayer] = []
    for (place, _, _), layer in sorted(found, key=lambda each: each[0]):
        count = sum(other.kind == layer.kind for other in best)
        (best if count < RULES[place].most else others).append(layer)
    return best, others
