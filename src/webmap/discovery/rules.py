"""The rules: which topics fit which role, and which namespaces are robots.

A rule has a pattern for the end of a topic's name. The part before the end is the
robot's namespace. Between the two there may be names of parts of a robot, such as a
controller's, which are no robots. Rules of one role are in order: the first match
determines the rank of the topic.

A robot is a namespace with a topic for the pose or for the velocity. A namespace with
only one of the two inside another robot's namespace is a part of that robot: a camera
with its own odometry, or an input of a velocity mux. So is a namespace anywhere that
has odometry with a ``child_frame_id`` of that robot and no topic for the velocity.
"""

import re
from collections import Counter
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from posixpath import commonpath
from typing import NamedTuple

from webmap.base.errors import ConfigError
from webmap.config.motion import TWIST_TYPES
from webmap.discovery.findings import TopicRole
from webmap.discovery.tf_robots import BASE, Base, Trees
from webmap.ros.names import PICTURES, VIDEO, split_type

PARTS = (
    r"[^/]*controller|controllers|mobile_base|base|platform|drive|navigation|nav|"
    r"sensors?|sensing|perception|localization|amcl|move_base|planner_server|"
    r"twist_mux|joy_teleop|teleop|keyboard|joystick|hardware|status|camera[^/]*|"
    r"lidar[^/]*|laser[^/]*|front[^/]*|rear[^/]*|left[^/]*|right[^/]*|"
    r"(?:global|local)_costmap|visual_slam|slam_toolbox|rtabmap|webmap|"
    r"cmd_vel_mux|yocs_cmd_vel_mux|ekf[^/]*|ukf[^/]*|robot_localization|odometry|"
    r"mavros|local_position|global_position|setpoint_velocity|vision_pose|mocap|"
    r"fake_gps|wheel_odometry"
)
"""Pattern of names that are parts of a robot and never a robot."""

ODOMETRY = ("nav_msgs/Odometry",)
POSES = ("geometry_msgs/PoseWithCovarianceStamped", "geometry_msgs/PoseStamped")
BARE_POSES = ("geometry_msgs/Pose", "geometry_msgs/Pose2D")
VELOCITY = TWIST_TYPES
GRID = ("nav_msgs/OccupancyGrid",)
PATH = ("nav_msgs/Path",)

DEPTH = (
    r"/(?:depth(?:_registered|_image[^/]*)?|aligned_depth[^/]*|image_depth[^/]*|"
    r"compressedDepth|zstd)(?:/|\Z)"
)
"""Pattern in names of pictures that show depth instead of color.

A camera named after its kind, such as ``depth_camera``, has color pictures too.
Browsers cannot show pictures compressed with zstd.
"""

VISUAL = r"/(?:[^/]*camera[^/]*|zed[^/]*|t265|visual_slam|rtabmap|vins[^/]*)/"
"""Pattern in names of odometry that is computed from pictures."""

FUSED = "a filter's estimate"
"""The reason for odometry that a filter computes from several sensors."""


@dataclass(frozen=True, slots=True)
class Rule:
    """A role for topics of some types whose names end in some way."""

    role: TopicRole
    types: tuple[str, ...]
    """Names of types, without a dialect."""

    tail: str
    """Pattern for the end of the name, without the slash before it."""

    reason: str
    """The reason why such a topic fits, for people."""

    unless: str = r"(?!)"
    """Pattern that must not occur anywhere in the name."""


RULES: tuple[Rule, ...] = (
    Rule("odometry", ODOMETRY, r"odom(?:etry)?/filtered", FUSED),
    Rule("odometry", ODOMETRY, r"odometry/(?:global|local)", FUSED),
    Rule("odometry", ODOMETRY, r"local_position/odom", "an autopilot's estimate"),
    Rule("odometry", ODOMETRY, r"odom", "the usual name", VISUAL),
    Rule("odometry", ODOMETRY, r"odometry", "the usual name, written out", VISUAL),
    Rule(
        "odometry",
        ODOMETRY,
        r"(?:[^/]*ground_truth[^/]*)(?:/[^/]+)?",
        "a simulator's ground truth, used if there is no other",
    ),
    Rule("odometry", ODOMETRY, r"odom(?:etry|/sample)?", "the odometry of a camera"),
    Rule("odometry", ODOMETRY, r"global_position/local", "the position by GPS"),
    Rule("odometry", ODOMETRY, r"odometry/(?:in|out)", "to or from an autopilot"),
    Rule("odometry", ODOMETRY, r"[^/]+", "its type alone"),
    Rule("pose", POSES[:1], r"amcl_pose", "AMCL's pose on the map"),
    Rule("pose", POSES, r"(?:robot_pose|localization_pose)", "a localiser's pose"),
    Rule("pose", POSES, r"pose", "the usual name of a localiser's pose"),
    Rule("pose", BARE_POSES, r"robot_pose", "a robot's pose, without its frame"),
    Rule("pose", BARE_POSES, r"pose|pose2[dD]", "a pose, without its frame"),
    Rule(
        "velocity",
        VELOCITY,
        r"webmap/cmd_vel",
        "an input made for WebMap",
    ),
    Rule("velocity", VELOCITY, r"cmd_vel", "the usual name"),
    Rule("velocity", VELOCITY, r"cmd_vel_unstamped", "a controller's plain input"),
    Rule("velocity", VELOCITY, r"commands/velocity", "the base's own input"),
    Rule(
        "velocity",
        VELOCITY,
        r"cmd_vel_mux/input/teleop",
        "a mux's input for teleoperation",
    ),
    Rule("velocity", VELOCITY, r"input/teleop", "a mux's input for teleoperation"),
    Rule("scan", ("sensor_msgs/LaserScan",), r"scan", "the usual name"),
    Rule("scan", ("sensor_msgs/LaserScan",), r"base_scan", "the usual name of Stage"),
    Rule("scan", ("sensor_msgs/LaserScan",), r"[^/]+", "its type alone"),
    Rule(
        "battery",
        ("sensor_msgs/BatteryState",),
        r"battery(?:_state)?",
        "the usual name",
    ),
    Rule("battery", ("sensor_msgs/BatteryState",), r"[^/]+", "its type alone"),
    Rule("plan", PATH, r"plan", "the usual name"),
    Rule("plan", PATH, r"[^/]*(?:global|Global|Navfn)[^/]*/[^/]*plan", "a global plan"),
    Rule("plan", PATH, r"[^/]*plan[^/]*", "named a plan"),
    Rule(
        "goal",
        ("geometry_msgs/PoseStamped",),
        r"goal_pose",
        "the goal topic of Nav2 and RViz",
    ),
    Rule(
        "goal",
        ("geometry_msgs/PoseStamped",),
        r"move_base_simple/goal",
        "the goal topic of move_base and RViz",
    ),
    Rule(
        "action",
        ("nav2_msgs/NavigateToPose_FeedbackMessage",),
        r"navigate_to_pose/_action/feedback",
        "Nav2's action, which reports the progress of a goal",
    ),
    Rule(
        "action",
        ("move_base_msgs/MoveBaseActionGoal",),
        r"move_base/goal",
        "move_base's action, which reports the progress of a goal",
    ),
    Rule(
        "initialpose",
        POSES[:1],
        r"initialpose",
        "the initial pose topic of AMCL and RViz",
    ),
    Rule(
        "cancel",
        ("actionlib_msgs/GoalID",),
        r"move_base/cancel",
        "the topic that cancels goals of move_base",
    ),
    Rule("costmap", GRID, r"[^/]*costmap[^/]*(?:/[^/]+)?", "named a costmap"),
    Rule("map", GRID, r"map", "the usual name"),
    Rule("map", GRID, r"[^/]+", "its type alone"),
    Rule("camera", PICTURES[:1], r"[^/]+/compressed", "compressed pictures", DEPTH),
    Rule("camera", PICTURES[1:], r"[^/]*image[^/]*", "pictures, not compressed", DEPTH),
    Rule("camera", PICTURES[:1], r"[^/]+", "its type alone", DEPTH),
    Rule("camera", PICTURES[1:], r"[^/]+", "its type alone", DEPTH),
    Rule("camera", VIDEO, r"[^/]+", "video", DEPTH),
    Rule("cloud", ("sensor_msgs/PointCloud2",), r"[^/]+", "its type alone"),
    Rule("tf", ("tf2_msgs/TFMessage",), r"tf", "the frames of the robot"),
)

INNER_VELOCITY = re.compile(r"cmd_vel|velocity|teleop")
"""Pattern of other Twist names that may be inner steps on the path to the base."""


class Match(NamedTuple):
    """A topic that fits a role."""

    role: TopicRole
    rank: tuple[int, int, str]
    """Smaller is better: the rule's place, the parts before the name, the name."""

    namespace: str
    topic: str
    type: str
    reason: str


def match(topic: str, type: str) -> Match | None:
    """Return the role that a topic fits, None if none."""
    try:
        plain = str(split_type(type))
    except ConfigError:
        return None
    for place, rule in enumerate(RULES):
        if plain not in rule.types or re.search(rule.unless, topic):
            continue
        found = _pattern(rule.tail).match(topic)
        if found is not None:
            between = found["parts"].count("/")
            rank = (place, between, topic)
            return Match(rule.role, rank, found["ns"], topic, type, rule.reason)
    return None


@cache
def _pattern(tail: str) -> re.Pattern[str]:
    """Return the pattern of topics, compiled at its first use: it takes long."""
    # The shortest namespace matches, so that parts of a robot do not count as robots.
    return re.compile(rf"(?P<ns>(?:/[^/]+)*?)/(?P<parts>(?:(?:{PARTS})/)*)(?:{tail})\Z")


MOVING = ("odometry", "pose", "velocity")
"""Roles that make a namespace a robot."""


def robot_by_frames(matches: Sequence[Match], trees: Trees) -> dict[str, str]:
    """Return the robot's namespace of each namespace with odometry of a known base."""
    roles: dict[str, set[str]] = {}
    for each in matches:
        roles.setdefault(each.role, set()).add(each.namespace)
    driven = roles.get("velocity", set())
    groups: dict[Base, set[str]] = {}
    for each in matches:
        child = trees.odometry.get(each.topic)
        if child:
            frames = nearest(each.topic, roles.get("tf", ())) or ""
            base = trees.base_of(child, frames)
            group = groups.setdefault(base, set())
            group.add(each.namespace)
            if BASE.match(base.frame) and (base.space or "" in driven):
                group.add(base.space)
    robots: dict[str, str] = {}
    for base, group in groups.items():
        # Frames without a prefix may belong to several robots that are driven.
        found = group & driven or group & {base.space}
        if len(found) == 1 or (not found and len(group) > 1):
            outer = commonpath([f"{space}/" for space in group]).rstrip("/")
            robots |= dict.fromkeys(group, min(found, default=outer))
    return robots | {robot: robot for robot in robots.values()}


def robot_namespaces(
    matches: Iterable[Match], by_frames: Mapping[str, str]
) -> tuple[str, ...]:
    """Return the namespaces that are robots, sorted; one may be empty.

    Args:
        matches: The topics that fit a role.
        by_frames: The robots that are known by their frames.

    """
    halves: dict[str, set[str]] = {}
    for each in matches:
        if each.role in MOVING:
            half = "velocity" if each.role == "velocity" else "place"
            space = by_frames.get(each.namespace, each.namespace)
            halves.setdefault(space, set()).add(half)
    outer = {space: nearest(space, halves) for space in halves}
    # Counts the namespaces in the same robot with exactly the same half.
    alike = Counter((outer[space], *sorted(has)) for space, has in halves.items())
    kept = set(halves)
    # The inputs of a robot are first: it is whole with them, whatever their names are.
    order = sorted(halves, key=lambda space: ("place" in halves[space], -_depth(space)))
    for space in order:
        around, has = outer[space], halves[space]
        if around is None or len(has) == 2 or space in by_frames:
            continue
        alone = alike[(around, *sorted(has))] == 1
        # Several in a whole robot are inputs or sensors; several others may be a fleet.
        if alone or len(halves[around]) == 2:
            kept.discard(space)
            halves[around] |= has
    return tuple(sorted(kept))


def nearest(name: str, namespaces: Container[str]) -> str | None:
    """Return the innermost of the namespaces that contain a name, None if none.

    All names are in the empty namespace, except the empty one itself.
    """
    while name:
        name = name.rpartition("/")[0]
        if name in namespaces:
            return name
    return None


def inside(name: str, namespace: str) -> bool:
    """Return whether a name is in a namespace; all names are in the empty one."""
    return name.startswith(namespace + "/")


def _depth(namespace: str) -> int:
    return namespace.count("/")
