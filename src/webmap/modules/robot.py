"""Modules of robots, by name: ``webmap.modules.robot.LaserScanner``.

A built-in module is the class after which its file is named. The decorator ``register``
adds your own module. A package adds its modules by an entry point in the group
``webmap.modules.robot``.
"""

from typing import Any

from webmap.base.errors import ModuleNotFound
from webmap.core.registry import robot_modules as namespace

register = namespace.register


def __getattr__(name: str) -> Any:
    try:
        return namespace[name]
    except ModuleNotFound as error:
        raise AttributeError(str(error)) from error


def __dir__() -> list[str]:
    return [*namespace.names(), "namespace", "register"]
