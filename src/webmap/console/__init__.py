"""The console: the ready-made page that ``webmap demo`` and ``webmap view`` open.

It is made of WebMap's public API and of ``webmap.features``, so it is also the longest
example of the API. Open ``page`` first, then ``console.html``. What an operator can use
on other pages too belongs in ``webmap.features``.
"""

from webmap.console.console import Console
from webmap.console.page import open_console
from webmap.console.robot_looks import make_robot

__all__ = ["Console", "make_robot", "open_console"]
