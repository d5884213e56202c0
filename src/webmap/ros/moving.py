"""What sets robots in motion, and what a bridge therefore never publishes or calls.

Velocity, goals and cancel are written by the gate alone. :class:`WrittenByGate` refuses
what was declared for a robot. Where nobody has declared anything, names and types that
ROS packages give show what moves a robot. A service that moves a robot by itself, such
as one that docks, cannot be recognised by its name.
"""

import re
from weakref import WeakValueDictionary

from webmap.base.errors import ConfigError, MotionRefused
from webmap.ros.names import TypeName, is_type, split_type

STOP = "what STOP says"
"""What a topic carries that is a robot's stop hook."""

INSTEAD = {
    "a velocity": "Robot.twist()",
    "a goal": "Robot.move()",
    "the end of a goal": "Robot.cancel()",
    "an initial pose": "Robot.locate()",
    STOP: "Robot.stop() and Robot.reset_stop()",
}
"""What writes it, by what a topic carries."""

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
"""What the controllers of ros_control and ros2_control listen to."""

_NUMBERS = re.compile(
    r"std_msgs/(?:Float|U?Int)\d+(?:MultiArray)?|geometry_msgs/Vector3(?:Stamped)?"
)
"""Types that say nothing of what their numbers are."""

_NUMBERS_MOVE = re.compile(r"/(?:commands?|cmds?|vel|velocity|velocities)\Z")
"""Names at which such numbers are commands; at another, a message may be a text."""

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
    if _VELOCITY.search(last) or _CONTROLLER.search(name.lower()):
        return "a velocity"
    return _NAMES.get(last)


def moved_by_type(type: str) -> str | None:
    """Return what a message or a service of this type carries, if it moves robots.

    Args:
        type: In either dialect; a text that is no type moves nothing.

    Returns:
        What :func:`moved_by_name` returns, or that it is a simulator's.

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

    Neither tells it alone: wheels take a ``std_msgs/Float64MultiArray`` at
    ``/wheels/commands``, and so does a plot at ``/samples``.

    Args:
        name: The resolved name.
        type: In either dialect; a text that is no type moves nothing.

    """
    try:
        numbers = _NUMBERS.fullmatch(str(split_type(type)))
    except ConfigError:
        return None
    return "a velocity" if numbers and _NUMBERS_MOVE.search(name.lower()) else None


class WrittenByGate(dict[str, str]):
    """What the gate alone writes behind one address: what each topic carries."""

    def declare(self, topic: str, carries: str) -> None:
        """Refuse ``topic`` from now on.

        Args:
            topic: Its resolved name.
            carries: What it carries, in the words of :data:`INSTEAD`.

        """
        if self.get(topic, STOP) == STOP:  # a goal stays one
            self[topic] = carries

    def refuse_message(self, topic: str, *types: str | None) -> None:
        """Let a message pass unless it would move a robot.

        Args:
            topic: The resolved name of its topic.
            types: The types that it is said to have; None where nobody knows.

        Raises:
            MotionRefused: If it would.

        """
        carried = self.get(topic)
        if carried is not None:
            instead = INSTEAD.get(carried, "Robot.twist() or Robot.move()")
            raise MotionRefused(
                f"{topic} carries {carried} of a robot, which the gate alone writes: "
                f"use {instead}"
            )
        for type in types:
            if type is not None and is_type(type, *_TWISTS):
                raise MotionRefused(
                    f"{topic}: {type} is a velocity: use Robot.twist(), "
                    f"which goes through the gate"
                )

    def refuse_service(self, service: str) -> None:
        """Let a call pass unless it would send a robot somewhere.

        Args:
            service: The resolved name.

        Raises:
            MotionRefused: If it would.

        """
        # A topic that is a stop hook may well have a service of its name beside it.
        moves = self.get(service, STOP) != STOP
        if service.endswith(_SEND_GOAL) or moves:
            raise MotionRefused(
                f"{service}: goals go through the gate: use Robot.move()"
            )


_written: WeakValueDictionary[str, WrittenByGate] = WeakValueDictionary()


def written_behind(url: str) -> WrittenByGate:
    """Return what the gate writes behind an address; the same for all its bridges."""
    return _written.setdefault(url, WrittenByGate())
