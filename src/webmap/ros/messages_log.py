"""A typed view of what nodes log."""

import msgspec

from webmap.ros.messages import Header, Time

LEVELS = ("debug", "info", "warn", "error", "fatal")
"""The names of the levels, from the least."""

_ROS1 = {1: "debug", 2: "info", 4: "warn", 8: "error", 16: "fatal"}


class LogMsg(msgspec.Struct, frozen=True):
    """``rosgraph_msgs/Log`` of ROS 1 and ``rcl_interfaces/Log`` of ROS 2."""

    level: int
    name: str
    """The node's or the logger's name."""

    msg: str
    header: Header | None = None
    """There in ROS 1."""

    time: Time = msgspec.field(name="stamp", default=Time())
    """There in ROS 2; :attr:`stamp` is what to use."""

    @property
    def stamp(self) -> float:
        """When it was said, in seconds of the robot's clock."""
        return (self.time if self.header is None else self.header.stamp).seconds

    @property
    def level_name(self) -> str:
        """One of :data:`LEVELS`: levels are powers of two in ROS 1, and tens in ROS 2.

        What is between two is the lower one; what is below or above all, the nearest.
        """
        if self.header is not None and self.level in _ROS1:
            return _ROS1[self.level]
        return LEVELS[min(max(self.level // 10 - 1, 0), len(LEVELS) - 1)]
