"""The console: the ready-made page that ``webmap demo`` and ``webmap view`` open.

It is built with WebMap's public API alone, so it is also the longest example of it.
"""

from webmap.console.fleet import RobotDescription, parse_robot
from webmap.console.opened import Console
from webmap.console.page import open_console
from webmap.console.shapes import Picture

__all__ = ["Console", "Picture", "RobotDescription", "open_console", "parse_robot"]
