"""A typed view of the log messages of nodes."""

import msgspec

from webmap.ros.messages import Header, Time

LEVELS = ("debug", "info", "warn", "error", "fatal")
"""The names of the levels, from the least severe."""

_ROS1 = {1: "debug", 2: "info", 4: "warn", 8: "error", 16: "fatal"}


class LogMsg(msgspec.Struct, frozen=True):
    """``rosgraph_msgs/Log`` of ROS 1 and ``rcl_interfaces/Log`` of ROS 2."""

    level: int
    name: str
    """The name of the node or the logger."""

    msg: str
    header: Header | None = None
    """Present in ROS 1."""

    time: Time = msgspec.field(name="stamp", default=Time())
    """Present in ROS 2; use :attr:`stamp` for both."""

    @property
    def stamp(self) -> float:
        """Time of the log message, in seconds of the robot's clock."""
        return (self.time if self.header is None else self.header.stamp).seconds

    @property
    def level_name(self) -> str:
        """One of :data:`LEVELS`: levels are powers of two in ROS 1, and tens in ROS 2.

        A value between two levels gives the lower one; a value outside of all levels
        gives the nearest.
        """
        if self.header is not None and self.level in _ROS1:
            return _ROS1[self.level]
        return LEVELS[min(max(self.level // 10 - 1, 0), len(LEVELS) - 1)]
