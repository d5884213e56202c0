"""What a fleet file may say, and what that means."""

from dataclasses import dataclass, field
from typing import Any

from webmap.cli.fleet import checks
from webmap.cli.fleet.alignments import Alignment
from webmap.cli.fleet.cameras import CameraLine
from webmap.cli.fleet.checks import Check
from webmap.cli.fleet.lines import Path
from webmap.cli.fleet.pictures import PictureLine
from webmap.cli.fleet.places import Places

TOP = (
    "title",
    "floor",
    "map",
    "image",
    "modules",
    "tiles",
    "labels",
    "bridges",
    "robots",
)
ODOMETRY: dict[str, Check] = {
    "topic": checks.topic,
    "type": checks.message_type(
        "nav_msgs/Odometry",
        "geometry_msgs/Pose",
        "geometry_msgs/PoseStamped",
        "geometry_msgs/PoseWithCovarianceStamped",
        "geometry_msgs/Pose2D",
    ),
    "throttle": checks.milliseconds,
}
TWIST: dict[str, Check] = {
    "topic": checks.topic,
    "type": checks.message_type("geometry_msgs/Twist", "geometry_msgs/TwistStamped"),
    "stops_within": checks.above_zero("seconds"),
    "v_max": checks.above_zero("metres per second"),
    "w_max": checks.above_zero("radians per second"),
    "z_max": checks.above_zero("metres per second"),
    "rx_max": checks.above_zero("radians per second"),
    "ry_max": checks.above_zero("radians per second"),
    "a_max": checks.above_zero("metres per second squared"),
    "holonomic": checks.yes_or_no,
    "stop_hooks": lambda value: value,  # read with the way to each of them
}
TF: dict[str, Check] = {
    "map_frame": checks.text,
    "base_frame": checks.text,
    "namespace": checks.topic,
    "quiet": checks.yes_or_no,
}
MOVE: dict[str, Check] = {
    "topic": checks.topic,
    "frame": checks.text,
    "cancel_topic": checks.topic,
    "on_operator_loss": checks.one_of("continue", "cancel"),
    "action": checks.topic,
    "action_type": checks.message_type(
        "nav2_msgs/NavigateToPose", "move_base_msgs/MoveBaseAction"
    ),
}
INITIAL_POSE: dict[str, Check] = {
    "topic": checks.topic,
    "covariance": checks.covariance,
    "frame": checks.text,
}
ROBOT = (
    "name",
    "bridge",
    "base_link",
    "picture",
    "odometry",
    "tf",
    "alignment",
    "twist",
    "move",
    "initial_pose",
    "scan",
    "scan_assist",
    "battery",
    "cameras",
    "buttons",
    "modules",
)
MODULE = ("name", "args", "options")


@dataclass(slots=True)
class ModuleLine:
    """One module of a robot, or of the map."""

    name: str
    args: list[Any]
    options: dict[str, Any]
    path: Path


@dataclass(slots=True)
class RobotLine:
    """One robot of a file."""

    name: str
    bridge: str
    path: Path
    base_link: str = "base_link"
    picture: PictureLine | None = None
    odometry: dict[str, Any] | None = None
    tf: dict[str, Any] | None = None
    alignment: Alignment | None = None
    twist: dict[str, Any] | None = None
    move: dict[str, Any] | None = None
    initial_pose: dict[str, Any] | None = None
    scans: list[str] = field(default_factory=list)
    scan_assist: dict[str, Any] | None = None
    battery: str = ""
    cameras: list[CameraLine] = field(default_factory=list)
    buttons: list[dict[str, Any]] = field(default_factory=list)
    modules: list[ModuleLine] = field(default_factory=list)


@dataclass(slots=True)
class Fleet:
    """What a file says."""

    bridges: dict[str, str] = field(default_factory=dict)
    """Addresses by name."""

    alignments: dict[str, Alignment] = field(default_factory=dict)
    """Of bridges, by name."""

    robots: list[RobotLine] = field(default_factory=list)
    title: str = ""
    floor: str = ""
    maps: list[dict[str, Any]] = field(default_factory=list)
    """The maps under the robots: the name of a ``bridge``, a ``topic``, and options."""

    images: list[dict[str, Any]] = field(default_factory=list)
    """Pictures under everything: ``file``, ``x``, ``y``, ``width`` and ``height``."""

    modules: list[ModuleLine] = field(default_factory=list)
    """Modules of the map."""

    tiles: dict[str, Any] | None = None
    labels: Places | None = None
