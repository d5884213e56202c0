"""Topics and services that move robots, and that a bridge never publishes or calls.

Only the gate publishes velocity, goals and cancel. :class:`WrittenByGate` refuses the
topics that were declared for a robot. For other topics, names and types of ROS packages
show whether they move a robot. A service that moves a robot by itself, such as docking,
cannot be recognised by its name.
"""

import re
from weakref import WeakValueDictionary

from webmap.base.errors import ConfigError, MotionRefused
from webmap.ros.names import TypeName, is_type, split_type

STOP = "the STOP"
"""Kind of a topic that is a robot's stop hook."""

INSTEAD = {
    "a velocity": "Robot.twist()",
    "a goal": "Robot.move()",
    "the end of a goal": "Robot.cancel()",
    "an initial pose": "Robot.locate()",
    STOP: "Robot.stop() and Robot.reset_stop()",
}
"""What to call instead, by what a topic carries."""

_TWISTS = ("geometry_msgs/Twist", "geometry_msgs/TwistStamped")
_SEND_GOAL = "/_action/send_goal"

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
    "the place or the speed of a simulated robot": (
        "gazebo_msgs/ModelState",
        "gazebo_msgs/ModelStates",
        "gazebo_msgs/EntityState",
        "gazebo_msgs/LinkState",
        "gazebo_msgs/LinkStates",
        "gazebo_msgs/SetModelState",
        "gazebo_msgs/SetEntityState",
        "gazebo_msgs/SetLinkState",
        "gazebo_msgs/SetModelConfiguration",
        "gazebo_msgs/ApplyBodyWrench",
        "gazebo_msgs/ApplyLinkWrench",
        "gazebo_msgs/ApplyJointEffort",
        "ros_gz_interfaces/SetEntityPose",
        "ros_gz_interfaces/EntityWrench",
        "simulation_interfaces/SetEntityState",
    ),
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
_VELOCITY = re.compile(
    r"(?:cmd|command|setpoint|target|desired).*vel|vel.*(?:cmd|command|setpoint|target)"
)
"""Last parts of names: cmd_vel_nav, stamped_cmd_vel, target_velocity, and the like."""

_CONTROLLER = re.compile(
    r"/[^/]*controller[^/]*/(?:commands?|reference(?:_unstamped)?|joint_trajectory)\Z"
)
"""Command topics of the controllers of ros_control and ros2_control."""

_NUMBERS = re.compile(
    r"std_msgs/(?:Float|U?Int)\d+(?:MultiArray)?|geometry_msgs/Vector3(?:Stamped)?"
)
"""Types whose numbers may mean anything."""

_NUMBERS_MOVE = re.compile(r"/(?:commands?|cmds?|vel|velocity|velocities)\Z")
"""Names at which such numbers are commands; at other names they are allowed."""

_ACTION_TOPICS = ("ActionGoal",)
_ACTION_TYPES = ("_SendGoal", "_Goal")


def moved_by_name(name: str) -> str | None:
    """Return what a topic or service of this name carries, if it moves robots.

    Args:
        name: The resolved name.

    Returns:
        ``"a velocity"``, ``"a goal"``, ``"the end of a goal"``, or None.

    """
    if "/_action/" in name:
        return "the end of a goal" if name.endswith("/cancel_goal") else "a goal"
    last = name.rpartition("/")[2].lower()
    if _VELOCITY.search(last) or _CONTROLLER.search(name.lower()):
        return "a velocity"
    return _NAMES.get(last)


def moved_by_type(type: str) -> str | None:
    """Return what a message or service of this type carries, if it moves robots.

    Args:
        type: The type, in either dialect; text that is not a type gives None.

    Returns:
        A value of :func:`moved_by_name`, or the kind of a simulator's types.

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


def moved_by_both(name: str, type: str) -> str | None:
    """Return what numbers of this type carry at this name, if they move robots.

    Name and type are needed together: wheels subscribe to a
    ``std_msgs/Float64MultiArray`` at ``/wheels/commands``, and a plot to the same type
    at ``/samples``.

    Args:
        name: The resolved name.
        type: The type, in either dialect; text that is not a type gives None.

    """
    try:
        numbers = _NUMBERS.fullmatch(str(split_type(type)))
    except ConfigError:
        return None
    return "a velocity" if numbers and _NUMBERS_MOVE.search(name.lower()) else None


class WrittenByGate(dict[str, str]):
    """Topics of one address on which only the gate publishes, and what they carry."""

    def declare(self, topic: str, carries: str) -> None:
        """Refuse ``topic`` from now on.

        Args:
            topic: The resolved name of the topic.
            carries: What it carries: a key of :data:`INSTEAD`.

        """
        if self.get(topic, STOP) == STOP:  # other kinds have precedence
            self[topic] = carries

    def refuse_message(self, topic: str, *types: str | None) -> None:
        """Check that a message does not move a robot.

        Args:
            topic: The resolved name of its topic.
            types: The types that are stated for the topic; None if unknown.

        Raises:
            MotionRefused: If the message would move a robot.

        """
        carried = self.get(topic)
        if carried is not None:
            instead = INSTEAD.get(carried, "Robot.twist() or Robot.move()")
            raise MotionRefused(
                f"{topic} carries {carried} of a robot, which only the gate publishes: "
                f"use {instead}"
            )
        for type in types:
            if type is not None and is_type(type, *_TWISTS):
                raise MotionRefused(
                    f"{topic}: {type} is a velocity: use Robot.twist(), "
                    f"which goes through the gate"
                )

    def refuse_service(self, service: str) -> None:
        """Check that a service does not move a robot.

        Args:
            service: The resolved name.

        Raises:
            MotionRefused: If the service would move a robot.

        """
        # A topic that is a stop hook may share its name with a service.
        moves = self.get(service, STOP) != STOP
        if service.endswith(_SEND_GOAL) or moves:
            raise MotionRefused(
                f"{service}: goals go through the gate: use Robot.move()"
            )


_written: WeakValueDictionary[str, WrittenByGate] = WeakValueDictionary()


def written_behind(url: str) -> WrittenByGate:
    """Return what only the gate publishes at an address; shared by all its bridges."""
    return _written.setdefault(url, WrittenByGate())
