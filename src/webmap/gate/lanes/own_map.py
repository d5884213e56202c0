"""From the common map, which people point at, to a robot's own."""

from dataclasses import replace
from typing import TypeVar

from webmap.base.geometry import Pose
from webmap.gate.actions import SendGoal, TellPose
from webmap.gate.messages import RobotSpec

Place = TypeVar("Place", SendGoal, TellPose)

_COMMON = (0.0, 0.0, 0.0)


def in_own_map(spec: RobotSpec, at: Place) -> Place:
    """Return what a robot is told, with its numbers in the robot's own map.

    Args:
        spec: The robot.
        at: What it is told, with numbers on the common map.

    """
    if spec.own_map == _COMMON:
        return at
    own = Pose(*spec.own_map).inverse @ Pose(at.x, at.y, at.yaw)
    return replace(at, x=own.x, y=own.y, yaw=own.yaw)
