"""The simulators that these tests share with those of other commands."""

from command_fixtures import later_port, ros1, ros2

__all__ = ["later_port", "ros1", "ros2"]
