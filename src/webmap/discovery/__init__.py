"""Discovery: from the topics of a ROS system to the robots behind it.

The rules are plain functions of names and types, so that they can be read, shown and
overruled. They are written down for people in ``docs/howto/connect-a-robot.md``.
"""

from webmap.discovery.found import Findings, FoundRobot, Guess
from webmap.discovery.robots import discover

__all__ = ["Findings", "FoundRobot", "Guess", "discover"]
