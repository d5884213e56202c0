"""Drawing one topic that was found with the robot that it is about."""

import logging
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING

from webmap.cli.overruling import RULE
from webmap.discovery import FoundRobot
from webmap.discovery.drawing import drawing
from webmap.discovery.found import Role
from webmap.discovery.layers import FoundLayer, Kind, is_own
from webmap.errors import WebMapError
from webmap.scope import no_scope

if TYPE_CHECKING:
    from webmap import Bridge, Robot
    from webmap.console import Console

log = logging.getLogger("webmap.cli")

ROLES: dict[Kind, Role] = {
    "scan": "scan",
    "map": "map",
    "grid": "map",
    "path": "plan",
    "cloud": "cloud",
    "costmap": "costmap",
    "global costmap": "costmap",
}
"""Which role a topic may have that is drawn so."""


def shows(robot: "Robot", bridge: "Bridge", topic: str) -> bool:
    """Tell whether a topic is drawn with a robot already, or says where it is."""
    feed = robot.feed
    if feed is not None and feed.bridge is bridge and feed.topic == topic:
        return True
    return any(getattr(module, "topic", None) == topic for module in robot.modules)


def meant(
    layers: Iterable[FoundLayer], found: FoundRobot, fixed: Collection[str]
) -> list[FoundLayer]:
    """Return the layers but for those that a person said something else about.

    Args:
        layers: What is drawn of a robot by the rules.
        found: The robot as it was found, before anybody said anything.
        fixed: The roles that were said.

    """
    overruled = {
        (role, guess.topic)
        for role, guesses in found.guesses.items()
        if role in fixed
        for guess in guesses
    }
    return [
        layer
        for layer in layers
        if (ROLES.get(layer.kind), layer.topic) not in overruled
    ]


def shared_map(found: FoundRobot) -> str:
    """Return the map that a robot shares with others, or was said; empty if none.

    It is shown before anything else of the robot. A map of its own comes with it.
    """
    guess = found.first("map")
    if guess is None:
        return ""
    named = guess.topic.rpartition("/")[2].endswith("map")
    shared = named and not is_own(guess.topic, found.namespace)
    return guess.topic if shared or guess.rule == RULE else ""


def draw_layer(
    robot: "Robot",
    bridge: "Bridge",
    layer: FoundLayer,
    namespace: str,
    console: "Console | None" = None,
) -> bool:
    """Draw a topic of a robot, unless it is drawn already.

    Args:
        robot: The robot.
        bridge: The bridge that it is behind.
        layer: What was found.
        namespace: The robot's namespace.
        console: Where maps are shown that all robots share; none are without it, nor
            a robot's own.

    Returns:
        Whether it is drawn by this.

    """
    if shows(robot, bridge, layer.topic):
        return False
    if console is None and layer.kind in ("map", "grid"):
        return False
    scans = sum(type(module).__name__ == "LaserScanner" for module in robot.modules)
    drawn = drawing(layer, namespace, robot.tf, scans + 1)
    try:
        with no_scope():
            if drawn.shared and console is not None:
                return console.add_grid(bridge, layer.topic, **drawn.options)
            what = ("OnMaps", drawn.module) if drawn.of_maps else (drawn.module,)
            module = robot.add_module(*what, bridge, layer.topic, **drawn.options)
            if layer.kind == "scan":
                robot.svg.insert(1, module.svg)  # after the title, under the body
    except WebMapError as error:
        log.warning("%s: %s is not drawn: %s", robot.name, layer.topic, error)
        return False
    return True
