"""The modules that come with WebMap, and where to add one's own.

``webmap.modules.map`` and ``webmap.modules.robot`` are the two namespaces of the
report of 2012.
"""

from webmap.modules import map, robot

__all__ = ["map", "robot"]
