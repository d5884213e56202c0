"""Which module draws what was found, and with which arguments."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from webmap.discovery.layers import FoundLayer, Kind, is_own


@dataclass(frozen=True, slots=True)
class Drawing:
    """A module that draws one topic of a robot."""

    module: str
    """Its name; it takes a bridge and the topic first."""

    options: dict[str, Any] = field(default_factory=dict)
    of_maps: bool = False
    """Whether it is a module of maps, which a robot brings along by ``OnMaps``."""

    shared: bool = False
    """Whether it is nobody's own, and lies on the map once for all robots."""


PLAIN: Mapping[Kind, Drawing] = {
    "cloud": Drawing("PointCloud", {"throttle": 1000, "colour_by": "z"}),
    "local plan": Drawing("Path", {"name": "local"}),
    "path": Drawing("Path"),
    "doubt": Drawing("PoseWithCovariance"),
    "footprint": Drawing("Polygon"),
    "polygon": Drawing("Polygon", {"name": "other", "age_limit": 60.0}),
    "goal": Drawing("PoseStamped", {"name": "goal"}),
    "pose": Drawing("PoseStamped"),
    # A controller gives it in the frame of the base, also where no frames are told.
    "lookahead": Drawing(
        "PointStamped", {"name": "lookahead", "frame": "robot", "age_limit": 2.0}
    ),
    "point": Drawing("PointStamped"),
    "cells": Drawing("GridCells"),
    "range": Drawing("Range"),
    "fix": Drawing("NavSatFix"),
}
"""What needs to know no more than the topic."""


def drawing(
    layer: FoundLayer,
    namespace: str,
    frames: Mapping[str, Any] | None,
    number: int = 1,
) -> Drawing:
    """Return what draws a layer of a robot.

    Args:
        layer: The layer.
        namespace: The robot's: ``/robot_0``, or empty.
        frames: ``map_frame`` and ``namespace`` of the robot's frames; None if it has
            none.
        number: Which of the robot's layers of this kind it is, from 1.

    """
    placed: dict[str, Any] = {}
    if frames is not None:
        placed = {key: frames[key] for key in ("map_frame", "namespace")}
    topic = layer.topic
    match layer.kind:
        case "fix" if layer.type.endswith("GPSFix"):
            return Drawing("NavSatFix", {"type": layer.type})
        case "map":
            if not is_own(topic, namespace):
                return Drawing("OccupancyGrid", shared=True)
            return Drawing("OccupancyGrid", placed, of_maps=True)
        case "grid" if not is_own(topic, namespace):
            return Drawing("OccupancyGrid", {"palette": "costmap"}, shared=True)
        case "global costmap":
            # All of the map, under the local one: it is large, and changes slowly.
            whole = {"palette": "costmap", "throttle": 5000, "order": 15.0, **placed}
            return Drawing("OccupancyGrid", whole, of_maps=True)
        case "grid" | "costmap":
            options = {"palette": "costmap", "throttle": 500, **placed}
            return Drawing("OccupancyGrid", options, of_maps=True)
        case "scan":
            options = {"max_dots": None, "throttle": 100, "name": scan_name(number)}
            return Drawing("LaserScanner", options)
        case "particles" | "poses":
            return Drawing("PoseArray", {"type": layer.type})
        case "markers":
            return Drawing("Markers", {"type": layer.type, **placed}, of_maps=True)
        case "health":
            # On a topic of its own there is nobody to tell it from.
            shared = namespace if not is_own(topic, namespace) else ""
            return Drawing("Diagnostics", {"namespace": shared})
        case _:
            return PLAIN[layer.kind]


def scan_name(number: int) -> str:
    """Return the class that gives one of a robot's scans a colour of its own."""
    return f"scan-{number}" if number > 1 else ""
