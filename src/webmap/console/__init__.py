"""The console: the ready-made page that ``webmap demo`` and ``webmap view`` open.

It is built with WebMap's public API alone, so it is also the longest example of it.
"""

from webmap.console.fleet import make_robot
from webmap.console.opened import Console
from webmap.console.page import open_console

__all__ = ["Console", "make_robot", "open_console"]
