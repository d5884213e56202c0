"""What the console shows: robots, told by their topics."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import webmap
from webmap.console.shapes import NameLabel, Picture, picture_model, robot_model
from webmap.errors import ConfigError

if TYPE_CHECKING:
    from webmap import Bridge, Robot

FORM = "NAME:ODOM:CMD_VEL:SCAN, as in Bob:/odom:/cmd_vel:/scan"


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotDescription:
    """A robot and its topics; what it does not have is empty."""

    name: str
    bridge: "Bridge"
    odometry: str = ""
    twist: str = ""
    twist_type: str = ""
    """``geometry_msgs`` Twist or TwistStamped in either dialect; empty if the bridge is
    to be asked for it."""
    scan: str = ""
    battery: str = ""
    cameras: tuple[str, ...] = ()
    """Topics of ``sensor_msgs/CompressedImage`` or ``Image``."""
    goal: str = ""
    """A topic of ``geometry_msgs/PoseStamped`` that sends it somewhere."""
    cancel: str = ""
    """A topic of ``actionlib_msgs/GoalID`` that calls goals off."""
    action: tuple[str, str] | None = None
    """The action that sends it somewhere and says how that goes: its name and its
    type, ``nav2_msgs/action/NavigateToPose`` or ``move_base_msgs/MoveBaseAction``."""
    initial_pose: str = ""
    """A topic of ``geometry_msgs/PoseWithCovarianceStamped`` that tells it where it
    is."""
    goal_frame: str = "map"
    """The frame of its map, in which goals and its place are told."""
    stops_within: float | None = None
    """Seconds within which the base stops by itself when velocity ceases, if known."""
    picture: Picture | None = None
    """How it looks from above, if not like all others."""


def parse_robot(
    text: str, bridges: Sequence["Bridge"], *, stops_within: float | None = None
) -> RobotDescription:
    """Read a robot as a person writes it on the command line.

    Args:
        text: ``NAME:ODOM:CMD_VEL:SCAN``; topics may be empty, and empty ones at the
            end left out. ``2@`` before the name says that the robot is behind the
            second bridge.
        bridges: The bridges there are.
        stops_within: Seconds within which the base stops by itself, if known.

    Raises:
        ConfigError: If the text is not of that form, or there is no such bridge.

    """
    number, _, rest = (
        text.rpartition("@")
        if "@" in text.partition(":")[0]
        else (
            "1",
            "",
            text,
        )
    )
    if not (number.isascii() and number.isdigit() and 0 < int(number) <= len(bridges)):
        raise ConfigError(
            f"robot {text!r}: {number!r} is no bridge's number; there are "
            f"{len(bridges)}, counted from 1"
        )
    name, *topics = (part.strip() for part in rest.split(":"))
    if not name or len(topics) > 3 or not any(topics):
        raise ConfigError(f"robot {text!r} is not of the form {FORM}")
    odometry, twist, scan = [*topics, "", "", ""][:3]
    return RobotDescription(
        name=name,
        bridge=bridges[int(number) - 1],
        odometry=odometry,
        twist=twist,
        scan=scan,
        stops_within=stops_within,
    )


def set_goals(
    robot: "Robot",
    bridge: "Bridge",
    goal: str,
    cancel: str,
    action: tuple[str, str] | None,
    *,
    frame: str = "map",
) -> None:
    """Say where a robot's goals go, if they go anywhere."""
    if goal or action:
        chosen = (
            {} if action is None else {"action": action[0], "action_type": action[1]}
        )
        robot.set_move_topic(
            bridge, goal, frame=frame, cancel_topic=cancel or None, **chosen
        )


def make_robot(about: RobotDescription) -> "Robot":
    """Return the robot of a description, with what the console shows of it."""
    bridge = about.bridge
    picture = about.picture
    model = robot_model() if picture is None else picture_model(picture)
    robot = webmap.Robot(about.name, model)
    if picture is not None:  # the name lies below it
        robot.svg.set_style("--reach", picture.reach)
    if about.odometry:
        robot.set_odometry_topic(bridge, about.odometry)
    if about.twist:
        robot.set_twist_topic(
            bridge,
            about.twist,
            type=about.twist_type or None,
            stops_within=about.stops_within,
        )
    set_goals(
        robot, bridge, about.goal, about.cancel, about.action, frame=about.goal_frame
    )
    if about.initial_pose:
        frame = about.goal_frame
        robot.set_initial_pose_topic(bridge, about.initial_pose, frame=frame)
    if about.scan:
        scanner = robot.add_module(
            "LaserScanner", bridge, about.scan, max_dots=None, throttle=100
        )
        robot.svg.insert(1, scanner.svg)  # after the title, under the body
    if about.battery:
        robot.add_module("Battery", bridge, about.battery)
    for number, topic in enumerate(about.cameras, 1):
        name = "Camera" if len(about.cameras) == 1 else f"Camera {number}"
        robot.add_module("Camera", bridge, topic, name)
    robot.add_module(NameLabel)
    return robot
