"""The console that is open: what comes later is shown on all its pages."""

import weakref
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from webmap import Bridge, Page, Robot


class Console:
    """What is shown on every page of the console besides what it was opened with."""

    def __init__(self) -> None:
        self.robots: list[Robot] = []
        """The robots that were added, in that order."""
        self.grid: tuple[Bridge, str] | None = None
        """The map under the robots, if one was added: a bridge and a topic."""
        self._modules: dict[str, dict[str, Any]] = {}
        self._pages: weakref.WeakSet[Page] = weakref.WeakSet()

    def add(self, robot: "Robot") -> None:
        """Show a robot on the pages that are open and on those to come."""
        self.robots.append(robot)
        for page in list(self._pages):
            _show(robot, page)

    def add_grid(self, bridge: "Bridge", topic: str) -> None:
        """Show a map under the robots, likewise; the first one stays.

        Args:
            bridge: The bridge that has it.
            topic: Of ``nav_msgs/OccupancyGrid``.

        """
        if self.grid is None:
            self.grid = (bridge, topic)
            for page in list(self._pages):
                _show_grid(self.grid, page)

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
            _add_module(name, options, page)
        if self.grid is not None:
            _show_grid(self.grid, page)
        for robot in self.robots:
            _show(robot, page)


def _show(robot: "Robot", page: "Page") -> None:
    for map in page.maps:
        map.add_robot(robot)


def _show_grid(grid: "tuple[Bridge, str]", page: "Page") -> None:
    for map in page.maps:
        map.add_module("OccupancyGrid", *grid)


def _add_module(name: str, options: dict[str, Any], page: "Page") -> None:
    for map in page.maps:
        try:
            map.add_module(name, **options)
        except ValueError as error:  # a file that was there is not any more
            map.report_error(f"{name} is not shown: {error}")
