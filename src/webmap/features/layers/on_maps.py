"""Modules of a robot that are added to every map that shows the robot."""

import inspect
from typing import Any

from webmap.base.errors import ModuleNotFound, WebMapError
from webmap.core.module_arguments import check_arguments
from webmap.core.registry import map_modules, robot_modules
from webmap.core.robot import Robot
from webmap.core.world_view import WorldView


@robot_modules.register
class OnMaps:
    """Adds a module to every map while the map shows the robot.

    For example a costmap or markers of a robot, which modules of maps draw:
    ``robot.add_module("OnMaps", "Markers", bridge, "/bob/markers")``. They are on the
    common map by the robot's alignment: a module with a ``robot`` argument gets this
    robot, unless another is given.

    Args:
        robot: The robot.
        module: The name of a map module.
        *args: Arguments for the constructor, after the map.
        **options: Keyword arguments for the constructor.

    Raises:
        ModuleNotFound: If there is no map module of that name.
        ConfigError: If the module does not accept the arguments.
    """

    def __init__(
        self, robot: Robot, /, module: str, *args: Any, **options: Any
    ) -> None:
        factory = map_modules[module]
        check_arguments(factory, args, options, first=1)
        if "robot" in inspect.signature(factory).parameters:
            options.setdefault("robot", robot)
        self.robot = robot
        self.module = module
        self._arguments = (args, options)
        self._modules: dict[WorldView, Any] = {}
        for map in robot.maps:
            self.on_map(map, True)

    def destroy(self) -> None:
        """Remove the modules."""
        for map in list(self._modules):
            self.on_map(map, False)

    def on_map(self, map: WorldView, shown: bool) -> None:
        """Add the module to a map that shows the robot now, or remove it."""
        if not shown:
            module = self._modules.pop(map, None)
            if module is not None and module in map.modules:
                map.remove_module(module)
            return
        args, options = self._arguments
        try:
            self._modules[map] = map.add_module(self.module, *args, **options)
        except ModuleNotFound:
            raise
        except WebMapError as error:
            map.report_error(f"{self.robot.name}: {self.module}: {error}")
