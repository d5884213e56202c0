"""Words that messages in both directions use."""

from typing import Literal

PROGRAM = "program"
"""The connection of the display's own Python code."""

Role = Literal["viewer", "operator", "admin"]
Velocity = tuple[float, float, float, float, float, float]
"""Forward, left and counter-clockwise; then upward, and about the forward and the left
axis, which are 0 for a robot that moves in the plane."""

Way = Literal["topic", "navigate_to_pose", "move_base"]
"""How goals are sent: as PoseStamped on a topic, by the action of ROS 2, or by that of
ROS 1."""
