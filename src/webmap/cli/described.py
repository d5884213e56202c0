"""From what was found to what the console shows."""

from typing import TYPE_CHECKING

from webmap.console import RobotDescription
from webmap.discovery import FoundRobot

if TYPE_CHECKING:
    from webmap import Bridge, Robot

MOST_CAMERAS = 4
"""Cameras of one robot that are shown; they are only asked while somebody looks."""


def describe(
    robot: FoundRobot, bridge: "Bridge", *, stops_within: float | None = None
) -> RobotDescription:
    """Return a robot that was found as the console takes it.

    Args:
        robot: The robot.
        bridge: The bridge that it is behind.
        stops_within: Seconds within which the base stops by itself, if known.

    """
    cameras = robot.guesses.get("camera", ())
    return RobotDescription(
        name=robot.name,
        bridge=bridge,
        odometry=robot.topic("odometry") or robot.topic("pose"),
        twist=robot.topic("velocity"),
        twist_type=robot.type_of("velocity"),
        scan=robot.topic("scan"),
        battery=robot.topic("battery"),
        cameras=tuple(guess.topic for guess in cameras[:MOST_CAMERAS]),
        goal=robot.topic("goal"),
        goal_frame=robot.map_frame,
        cancel=robot.topic("cancel"),
        action=robot.action,
        initial_pose=robot.topic("initialpose"),
        stops_within=stops_within,
    )


def cameras_left_out(robot: "Robot", found: FoundRobot) -> list[str]:
    """Return the topics of cameras that are not shown, since there are enough.

    Args:
        robot: The robot as it is shown.
        found: The same as it was found.

    """
    shown = {
        getattr(one, "topic", "") for one in robot.modules if hasattr(one, "watch")
    }
    if len(shown) < MOST_CAMERAS:
        return []
    cameras = found.guesses.get("camera", ())
    return [guess.topic for guess in cameras if guess.topic not in shown]


def overrules(told: RobotDescription, found: RobotDescription) -> bool:
    """Tell whether a robot that was told by hand is the one that was found.

    It is if they have a name, an odometry topic or a velocity topic in common.
    """
    if told.bridge is not found.bridge:
        return False
    return (
        told.name == found.name
        or (told.odometry != "" and told.odometry == found.odometry)
        or (told.twist != "" and told.twist == found.twist)
    )
