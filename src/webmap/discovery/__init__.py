"""Discovery: from the topics of a ROS system to its robots and layers.

The rules are plain functions of names and types, without I/O; open ``rules`` first.
``docs/reference/discovery.md`` lists them. What the commands do with the robots belongs
in ``webmap.fleet``.
"""

from webmap.discovery.findings import Findings, FoundRobot, Guess
from webmap.discovery.robots import discover

__all__ = ["Findings", "FoundRobot", "Guess", "discover"]
