"""The console that is open: what comes later is shown on all its pages."""

import time
import weakref
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from webmap import Bridge, Page, Robot

Factory: TypeAlias = str | Callable[..., Any]
"""The name of a module, or what makes one."""

TOP = 10.0
"""How near the first map lies: over those from files, under costmaps and robots."""


class Console:
    """What is shown on every page of the console besides what it was opened with.

    Args:
        told: The robots that it was opened with.

    """

    def __init__(self, told: "Sequence[Robot]" = ()) -> None:
        self.told = tuple(told)
        """The robots that it was opened with, in that order."""
        self.robots: list[Robot] = []
        """The robots that were added, in that order."""
        self.grids: dict[tuple[Bridge, str], dict[str, Any]] = {}
        """The maps under the robots, in the order in which they were added: for a
        bridge and a topic the options of ``OccupancyGrid``."""
        self.images: list[tuple[str, float, float, float, float]] = []
        """Pictures under everything else, as ``Map.add_image`` takes them."""
        self._modules: dict[str, dict[str, Any]] = {}
        self._more: list[tuple[Factory, tuple[Any, ...], dict[str, Any]]] = []
        self._pages: weakref.WeakSet[Page] = weakref.WeakSet()
        self._removed: dict[Robot, float] = {}
        """The robots that were taken off the pages, and when."""

    def add(self, robot: "Robot") -> None:
        """Show a robot on the pages that are open and on those to come."""
        self.robots.append(robot)
        for page in list(self._pages):
            _show(robot, page)

    def remove(self, robot: "Robot") -> None:
        """Take a robot off every page until a pose of it comes."""
        self._removed[robot] = time.monotonic()
        for page in list(self._pages):
            for map in page.maps:
                map.remove_robot(robot)

    def bring_back(self) -> None:
        """Show the robots again of which a pose has come since they were removed."""
        now = time.monotonic()
        for robot, since in list(self._removed.items()):
            if robot.hears_poses(now - since):
                del self._removed[robot]
                for page in list(self._pages):
                    _show(robot, page)

    def add_grid(self, bridge: "Bridge", topic: str, **options: Any) -> bool:
        """Show a map under the robots, likewise; one that is shown stays as it is.

        Args:
            bridge: The bridge that has it.
            topic: Of ``nav_msgs/OccupancyGrid``.
            **options: The other arguments of ``OccupancyGrid``. Maps lie in the order
                in which they came, the first on top, unless ``order`` says otherwise.

        Returns:
            Whether it is new.

        """
        if (bridge, topic) in self.grids:
            return False
        if "order" not in options and "palette" not in options:
            options["order"] = TOP - len(self.grids) / 100
        self.grids[bridge, topic] = options
        for page in list(self._pages):
            self._show_grids(page, only=(bridge, topic))
        return True

    def add_image(
        self, file: str, x: float, y: float, width: float, height: float
    ) -> None:
        """Show a picture under everything else, likewise.

        Args:
            file: Its path.
            x: The left edge, in metres.
            y: The lower edge, in metres.
            width: In metres.
            height: In metres.

        """
        self.images.append((file, x, y, width, height))
        for page in list(self._pages):
            _show_image(self.images[-1], page)

    def add_module(self, name: Factory, /, *args: Any, **options: Any) -> None:
        """Give the map of every page one module more.

        Args:
            name: The module's name, or what makes it.
            *args: What its constructor gets after the map.
            **options: Its arguments by name.

        """
        self._more.append((name, args, options))
        for page in list(self._pages):
            _add_module(name, args, options, page)

    def add_module_once(self, name: Factory, /, *args: Any, **options: Any) -> bool:
        """Give the map of every page a module, unless that was done already.

        Args:
            name: The module's name, or what makes it.
            *args: What its constructor gets after the map.
            **options: Its arguments by name.

        Returns:
            Whether the module is new.

        """
        new = (name, args, options) not in self._more
        if new:
            self.add_module(name, *args, **options)
        return new

    def set_module(self, name: str, /, **options: Any) -> None:
        """Give the map of every page to come a module, or that module more options.

        Args:
            name: The module's name.
            **options: Its arguments by name, besides those it was given before.

        """
        self._modules[name] = {**self._modules.get(name, {}), **options}

    def opened(self, page: "Page") -> None:
        """Show on a page that has been filled what was added until now."""
        self._pages.add(page)
        for name, options in self._modules.items():
            _add_module(name, (), options, page)
        for made, args, options in self._more:
            _add_module(made, args, options, page)
        for image in self.images:
            _show_image(image, page)
        self._show_grids(page)
        for robot in (*self.told, *self.robots):
            if robot not in self._removed:
                _show(robot, page)

    def _show_grids(
        self, page: "Page", *, only: "tuple[Bridge, str] | None" = None
    ) -> None:
        bridges = {bridge for bridge, _ in self.grids}
        for (bridge, topic), options in self.grids.items():
            if only not in (None, (bridge, topic)):
                continue
            for map in page.maps:
                grid = map.add_module("OccupancyGrid", bridge, topic, **options)
                if len(bridges) > 1:  # else the topic says which map it is
                    name = f"{topic} ({bridge.name})"
                    grid.layer.svg.set("data-layer", name)


def _show(robot: "Robot", page: "Page") -> None:
    for map in page.maps:
        map.add_robot(robot)


def _show_image(image: tuple[str, float, float, float, float], page: "Page") -> None:
    for map in page.maps:
        map.add_image(*image)


def _add_module(
    name: Factory, args: tuple[Any, ...], options: dict[str, Any], page: "Page"
) -> None:
    for map in page.maps:
        try:
            map.add_module(name, *args, **options)
        except ValueError as error:  # a file that was there is not any more
            map.report_error(f"{name} is not shown: {error}")
