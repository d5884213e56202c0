"""What sets robots in motion, by the names and the types of topics and services.

Velocity, goals and cancel are written by the gate alone. This says what they are where
nobody has declared them: by the names and types that ROS packages give them. A service
that moves a robot by itself, such as one that docks, cannot be told by its name.
"""

from webmap.errors import ConfigError
from webmap.ros.names import TypeName, split_type

_TYPES: dict[str, tuple[str, ...]] = {
    "a velocity": (
        "geometry_msgs/Twist",
        "geometry_msgs/TwistStamped",
        "geometry_msgs/TwistWithCovariance",
        "geometry_msgs/TwistWithCovarianceStamped",
        "geometry_msgs/Accel",
        "geometry_msgs/AccelStamped",
        "geometry_msgs/Wrench",
        "geometry_msgs/WrenchStamped",
        "ackermann_msgs/AckermannDrive",
        "ackermann_msgs/AckermannDriveStamped",
        "control_msgs/JointJog",
        "trajectory_msgs/JointTrajectory",
        "trajectory_msgs/MultiDOFJointTrajectory",
        "mavros_msgs/PositionTarget",
        "mavros_msgs/ManualControl",
        "sensor_msgs/Joy",
    ),
    "a goal": ("geometry_msgs/PoseStamped", "geometry_msgs/PoseArray", "nav_msgs/Path"),
    "the end of a goal": ("actionlib_msgs/GoalID", "action_msgs/CancelGoal"),
}
_KIND = {f"{name}": kind for kind, names in _TYPES.items() for name in names}
_NAMES = {
    "goal": "a goal",
    "goal_pose": "a goal",
    "goals": "a goal",
    "waypoints": "a goal",
    "cancel": "the end of a goal",
    "cmd_vel": "a velocity",
    "send_goal": "a goal",
    "cancel_goal": "the end of a goal",
}
_ACTION_TOPICS = ("ActionGoal",)
_ACTION_TYPES = ("_SendGoal", "_Goal")


def moved_by_name(name: str) -> str | None:
    """Return what a topic or a service of this name carries, if it moves robots.

    Args:
        name: The resolved name.

    Returns:
        ``"a velocity"``, ``"a goal"``, ``"the end of a goal"``, or None.

    """
    if "/_action/" in name:
        return "the end of a goal" if name.endswith("/cancel_goal") else "a goal"
    last = name.rpartition("/")[2].lower()
    if "cmd_vel" in last:  # cmd_vel_nav, stamped_cmd_vel, and the like
        return "a velocity"
    return _NAMES.get(last)


def moved_by_type(type: str) -> str | None:
    """Return what a message or a service of this type carries, if it moves robots.

    Args:
        type: In either dialect; a text that is no type moves nothing.

    """
    try:
        package, name = split_type(type)
    except ConfigError:
        return None
    if name.endswith(_ACTION_TOPICS) or name.endswith(_ACTION_TYPES):
        return "a goal"
    if name.endswith("_CancelGoal"):
        return "the end of a goal"
    return _KIND.get(str(TypeName(package, name)))
