"""The base classes of layers, and the namespaces of all modules.

``webmap.modules.map`` and ``webmap.modules.robot`` are the two namespaces of the report
of 2012. A layer derives from ``RobotLayer`` or ``MapLayer`` and declares its topics
with ``@layer``; open ``topic_layer`` first. The built-in layers are in
``webmap.features.layers``.
"""

from webmap.modules import map, robot

__all__ = ["map", "robot"]
