"""The open console: whatever is added later appears on all its pages."""

import time
import weakref
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from webmap import Bridge, Map, Page, Robot
from webmap.features.alerts.alert_store import AlertKeeper
from webmap.features.alerts.alerts import Alerts, AlertWatch, conditions
from webmap.features.incidents.incidents import Incidents
from webmap.features.shift_log.hand_over import RobotNow

Factory: TypeAlias = str | Callable[..., Any]
"""The name of a module, or a callable that makes one."""

TOP = 10.0
"""Order of the first map: above maps from files, below costmaps and robots."""

OUT = ("disobeys", "bridge", "lost", "commands", "health")
"""The kinds of alerts with which a robot is out of service, besides an active STOP."""


class Console:
    """What every page of the console shows in addition to the initial content.

    Args:
        given: The robots that the console was opened with.
        layers_off: The layers that are off until the user switches them on.
    """

    def __init__(
        self,
        given: Sequence[Robot] = (),
        layers_off: Sequence[str] = (),
    ) -> None:
        self.given = tuple(given)
        """The robots that the console was opened with, in that order."""
        self.layers_off = tuple(layers_off)
        """The layers that are off until the user switches them on."""
        self.robots: list[Robot] = []
        """The robots that were added, in that order."""
        self.routers: dict[str, Callable[[], tuple[str, str]]] = {}
        """What pages show of each router with agents, by its address.

        Returns ``"open"``, ``"connecting"`` or ``"lost"``, and a sentence.
        """
        self.grids: dict[tuple[Bridge, str], dict[str, Any]] = {}
        """The options of ``OccupancyGrid`` by bridge and topic, the first map first."""
        self._layers: weakref.WeakValueDictionary[tuple[Bridge, str], Any] = (
            weakref.WeakValueDictionary()
        )
        """The layers that draw the maps; all pages share them."""
        self.images: list[tuple[str, float, float, float, float]] = []
        """Pictures below everything else, as arguments of ``Map.add_image``."""
        self._modules: dict[str, dict[str, Any]] = {}
        self._more: list[tuple[Factory, tuple[Any, ...], dict[str, Any]]] = []
        self._pages: weakref.WeakSet[Page] = weakref.WeakSet()
        self._removed: dict[Robot, float] = {}
        """The robots that were removed from the pages, and the times."""
        self.alerts = Alerts()
        """The alerts of all robots, shared by all pages."""
        self.alert_watch = AlertWatch(self.alerts, self.shown_robots)
        self.alert_keeper: AlertKeeper | None = None
        self.incidents: Incidents | None = None
        """The incident recorder; None if nothing is recorded."""

    def keep_alerts(self, name: str) -> None:
        """Watch the robots for alerts, and keep those of earlier starts.

        Args:
            name: The name of the file with the alerts.
        """
        self.alert_keeper = AlertKeeper(self.alerts, self.shown_robots, name)
        self.alert_keeper.begin()
        self.alert_watch.begin()

    def shown_robots(self) -> list[Robot]:
        """Return the robots of both lists without those that were removed."""
        every = (*self.given, *self.robots)
        return [robot for robot in every if robot not in self._removed]

    def record_incidents(self) -> None:
        """Record the last minutes of all robots while the process runs."""
        self.incidents = Incidents(self.shown_robots, self.alerts)
        self.incidents.begin()

    def add(self, robot: Robot) -> None:
        """Show a robot on all open and future pages."""
        self.robots.append(robot)
        for map in self._maps:
            map.add_robot(robot)

    def remove(self, robot: Robot) -> None:
        """Remove a robot from every page until a new pose of the robot arrives."""
        self._removed[robot] = time.monotonic()
        for map in self._maps:
            map.remove_robot(robot)

    def forget(self, robot: Robot) -> None:
        """Remove a robot for good."""
        self.robots = [other for other in self.robots if other is not robot]
        self._removed.pop(robot, None)
        for map in self._maps:
            map.remove_robot(robot)

    def bring_back(self) -> None:
        """Show removed robots again from which a pose has arrived since the removal."""
        now = time.monotonic()
        for robot, since in list(self._removed.items()):
            if robot.hears_poses(now - since):
                del self._removed[robot]
                for map in self._maps:
                    map.add_robot(robot)

    def add_grid(self, bridge: Bridge, topic: str, **options: Any) -> bool:
        """Show a map under the robots on all pages; a map shown before stays unchanged.

        Args:
            bridge: The bridge that has the topic.
            topic: A topic of type ``nav_msgs/OccupancyGrid``.
            **options: The other arguments of ``OccupancyGrid``. Maps are drawn in the
                order in which they were added, the first on top, unless ``order`` is
                given.

        Returns:
            Whether the map is new.
        """
        if (bridge, topic) in self.grids:
            return False
        if "order" not in options and "palette" not in options:
            options["order"] = TOP - len(self.grids) / 100
        self.grids[bridge, topic] = options
        for map in self._maps:
            self._show_grids(map, only=(bridge, topic))
        return True

    def add_image(
        self, file: str, x: float, y: float, width: float, height: float
    ) -> None:
        """Show a picture below everything else on all pages.

        Args:
            file: The path of the picture.
            x: The left edge, in metres.
            y: The lower edge, in metres.
            width: In metres.
            height: In metres.
        """
        self.images.append((file, x, y, width, height))
        for map in self._maps:
            map.add_image(*self.images[-1])

    def add_module(self, name: Factory, /, *args: Any, **options: Any) -> None:
        """Add a module to the map of every page.

        Args:
            name: The module's name, or a callable that makes the module.
            *args: Arguments for the constructor, after the map.
            **options: Keyword arguments for the constructor.
        """
        self._more.append((name, args, options))
        for map in self._maps:
            _add_module(name, args, options, map)

    def add_module_once(self, name: Factory, /, *args: Any, **options: Any) -> bool:
        """Add a module to the map of every page, unless it was added before.

        Args:
            name: The module's name, or a callable that makes the module.
            *args: Arguments for the constructor, after the map.
            **options: Keyword arguments for the constructor.

        Returns:
            Whether the module is new.
        """
        new = (name, args, options) not in self._more
        if new:
            self.add_module(name, *args, **options)
        return new

    def set_module(self, name: str, /, **options: Any) -> None:
        """Add a module, or more options of the module, to the map of future pages.

        Args:
            name: The module's name.
            **options: Keyword arguments, in addition to those given before.
        """
        self._modules[name] = {**self._modules.get(name, {}), **options}

    def opened(self, page: Page) -> None:
        """Show everything that was added until now on a newly filled page."""
        self._pages.add(page)
        for map in page.maps:
            for name, options in self._modules.items():
                _add_module(name, (), options, map)
            for made, args, options in self._more:
                _add_module(made, args, options, map)
            for image in self.images:
                map.add_image(*image)
            self._show_grids(map)
            for robot in self.shown_robots():
                map.add_robot(robot)

    @property
    def _maps(self) -> list[Map]:
        return [map for page in list(self._pages) for map in page.maps]

    def _show_grids(self, map: Map, *, only: tuple[Bridge, str] | None = None) -> None:
        for (bridge, topic), options in self.grids.items():
            if only not in (None, (bridge, topic)):
                continue
            grid = map.add_module("OccupancyGrid", bridge, topic, **options)
            self._layers[bridge, topic] = grid.layer
        if len({bridge for bridge, _ in self.grids}) > 1:
            # The topic alone does not identify a map any more.
            for (bridge, topic), layer in self._layers.items():
                layer.svg.set("data-layer", f"{topic} ({bridge.name})")


def _add_module(
    name: Factory, args: tuple[Any, ...], options: dict[str, Any], map: Map
) -> None:
    try:
        map.add_module(name, *args, **options)
    except ValueError as error:  # the file no longer exists
        map.report_error(f"{name} is not shown: {error}")


def robot_now(robot: Robot) -> RobotNow:
    """Return a robot with the reason why it is out of service, if it is."""
    texts = conditions(robot)
    why = [texts[kind] for kind in OUT if kind in texts]
    report = robot.report
    if report is not None and report.stop is not None:
        why.insert(0, f"STOP active, pressed by {report.stop.by}")
    bridge = robot.pose_source.bridge
    name = "" if bridge is None else bridge.name or bridge.url
    return RobotNow(robot.id, robot.name, name, "; ".join(why))
