"""What else is drawn of robots that were found: all that their topics offer."""

import logging
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from webmap.cli.looking import Looking
from webmap.cli.overruling import Overruling
from webmap.discovery import FoundRobot, discover
from webmap.discovery.late_frames import late_frames
from webmap.discovery.layers import FoundLayer, Kind, find_layers
from webmap.discovery.robots import host_name
from webmap.errors import WebMapError
from webmap.scope import no_scope

if TYPE_CHECKING:
    from webmap import Bridge, Robot

log = logging.getLogger("webmap.cli")

SOON, LATER = 1.0, 15.0
"""Seconds between two looks: until something was found, and from then on."""

_services: list[object] = []
"""What runs as long as the process does; nobody else holds it."""


def draw_layers(
    bridges: Sequence["Bridge"],
    robots: Sequence["Robot"],
    overruling: Overruling | None = None,
) -> None:
    """Draw, as long as the process runs, what the robots of bridges offer.

    Args:
        bridges: The bridges.
        robots: The robots that are shown; more may come.
        overruling: What was said of robots better than it is guessed.

    """
    said = overruling or Overruling()
    _services.extend(DrawnLayers(bridge, robots, said) for bridge in bridges)


class DrawnLayers(Looking):
    """Looks again and again what can be drawn behind a bridge, and draws it.

    Args:
        bridge: The bridge.
        robots: The robots that are shown; more may come.
        overruling: What was said of robots better than it is guessed.

    """

    def __init__(
        self,
        bridge: "Bridge",
        robots: Sequence["Robot"],
        overruling: Overruling,
    ) -> None:
        super().__init__(bridge)
        self._overruling = overruling
        self._robots = robots
        self._drawn: set[tuple[int, str]] = set()

    @property
    def period(self) -> float:
        """Seconds between two looks from now on."""
        return LATER if self._drawn else SOON

    async def take(self, topics: dict[str, str]) -> None:
        """Draw what is new among the topics behind the bridge."""
        trees = late_frames(self.bridge).trees
        behind = discover(topics, host_name(self.bridge.url), trees)
        found = self._overruling.findings(self.bridge.url, behind).robots
        layers = find_layers(topics, [robot.namespace for robot in found])
        for one in found:
            robot = self._shown(one)
            if robot is None:
                continue
            for layer in layers[one.namespace]:
                key = (id(robot), layer.topic)
                if key not in self._drawn:
                    self._drawn.add(key)
                    self._draw(robot, layer, one.namespace)
            if (id(robot), "") not in self._drawn:
                self._drawn.add((id(robot), ""))
                with no_scope():
                    robot.add_module("Trail", length=10.0)

    def _shown(self, found: FoundRobot) -> "Robot | None":
        """Return the robot that is shown for one that was found."""
        topic = found.topic("odometry") or found.topic("pose")
        for robot in self._robots:
            feed = robot.feed
            if feed is None and self._has_base(robot, found):
                return robot
            if feed is None and robot.name == found.name:
                return robot
            if feed is not None and feed.bridge is self.bridge and feed.topic == topic:
                return robot
        return None

    def _has_base(self, robot: "Robot", found: FoundRobot) -> bool:
        """Return whether a robot is drawn by the base frame of one that was found."""
        frames = robot.tf
        if frames is None or frames["bridge"] is not self.bridge:
            return False
        space = found.tf_namespace or ""
        names = (found.base_frame, f"{space}/{found.base_frame}".strip("/"))
        mine = frames["namespace"] == space and frames["base_frame"] in names
        return found.base_frame != "" and mine

    def _draw(self, robot: "Robot", layer: FoundLayer, namespace: str) -> None:
        bridge, topic = self.bridge, layer.topic
        frames = robot.tf
        placed = (
            {}
            if frames is None
            else {"map_frame": frames["map_frame"], "namespace": frames["namespace"]}
        )
        add = robot.add_module
        draw: dict[Kind, Callable[[], object]] = {
            "costmap": lambda: add(
                "OnMaps",
                "OccupancyGrid",
                bridge,
                topic,
                palette="costmap",
                throttle=500,
                **placed,
            ),
            "cloud": lambda: add(
                "PointCloud", bridge, topic, throttle=1000, colour_by="z"
            ),
            "local plan": lambda: add("Path", bridge, topic, name="local"),
            "particles": lambda: add("PoseArray", bridge, topic, type=layer.type),
            "doubt": lambda: add("PoseWithCovariance", bridge, topic),
            "footprint": lambda: add("Polygon", bridge, topic),
            "range": lambda: add("Range", bridge, topic),
            "markers": lambda: add(
                "OnMaps", "Markers", bridge, topic, type=layer.type, **placed
            ),
            "fix": lambda: add("NavSatFix", bridge, topic),
            "health": lambda: add(
                "Diagnostics", bridge, topic, prefix=_prefix(topic, namespace)
            ),
        }
        try:
            with no_scope():
                draw[layer.kind]()
        except WebMapError as error:
            log.warning("%s: %s is not drawn: %s", robot.name, topic, error)


def _prefix(topic: str, namespace: str) -> str:
    """Return what the names of a robot's parts begin with on a topic of all robots."""
    shared = namespace and not topic.startswith(namespace + "/")
    return namespace.strip("/") + "/" if shared else ""
