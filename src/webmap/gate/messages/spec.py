"""What the display declares of a robot."""

from typing import Literal

import msgspec

from webmap.gate.messages.assist import AssistSpec


class RobotSpec(
    msgspec.Struct, frozen=True, kw_only=True, tag="declare", omit_defaults=True
):
    """What the gate must know of a robot. Sent again, it replaces the earlier one.

    As long as the robot is the same (bridge and velocity topic) a lease on it ends
    when anything else here changes.
    """

    id: str
    name: str
    """A label for people; need not be unique."""
    bridge_url: str
    """The rosbridge that velocity goes to."""
    twist_topic: str | None = None
    twist_type: str = "geometry_msgs/Twist"
    """Twist or TwistStamped, in either dialect; the stamp sent is zero."""
    base_frame: str = ""
    """The robot's own frame, which a TwistStamped names."""
    twist_type_assumed: bool = False
    """Whether nobody stated that type and no robot told it: another's word counts."""
    holonomic: bool = False
    """Whether the base can move sideways."""
    stops_within: float | None = None
    """Seconds after the last command until the base stops by itself, if known."""
    v_max: float | None = None
    """The highest speed in m/s, whatever the direction."""
    w_max: float | None = None
    """The highest rate of turn in rad/s, whatever the axis."""
    z_max: float | None = None
    """The highest speed upward and downward, in m/s. Without it the robot takes no
    velocity that has a z."""
    rx_max: float | None = None
    """The highest rate of turn about the forward axis, in rad/s; likewise."""
    ry_max: float | None = None
    """The highest rate of turn about the left axis, in rad/s; likewise."""
    a_max: float | None = None
    """Greatest growth of the speed, in m/s²; slowing down is never held back."""
    odometry_topic: str | None = None
    odometry_type: str | None = None
    odometry_url: str | None = None
    """The bridge of the odometry, if it is another."""
    goal_topic: str | None = None
    goal_url: str | None = None
    """The bridge of goals and cancel, if it is another."""
    goal_type: str = "geometry_msgs/PoseStamped"
    goal_frame: str = "map"
    cancel_topic: str | None = None
    """Where an empty ``actionlib_msgs/GoalID`` cancels every goal."""
    action: str | None = None
    """An action of the type below: it gets the goals, and is told to cancel them. The
    ``goal_topic`` is then for bridges that take no goals of actions."""
    action_type: str = "nav2_msgs/action/NavigateToPose"
    """``NavigateToPose`` of ``nav2_msgs``, or ``move_base_msgs/MoveBaseAction``."""
    on_operator_loss: Literal["continue", "cancel"] = "continue"
    """What becomes of a goal when the page (or program) that gave it is lost."""
    pose_topic: str | None = None
    """Where a ``PoseWithCovarianceStamped`` tells the robot where it is; on the bridge
    of the goals, in their frame."""
    pose_type: str = "geometry_msgs/PoseWithCovarianceStamped"
    pose_covariance: tuple[float, float, float] = (0.25, 0.25, 0.068)
    """How sure a person is of it: the variances of x and y in m², of yaw in rad²."""
    own_map: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the origin of its goal frame is on the common map: metres and radians.
    Goals and poses come on the common map, and are told to the robot in its own."""
    assist: AssistSpec | None = None
    """How the robot is slowed down before what its scanner sees; off without it."""
    stop_hooks: tuple[dict[str, str], ...] = ()
    """What else the robot's bridge is told on STOP: ``{"topic": "/lock", "type":
    "std_msgs/Bool"}`` publishes true (and false on reset), ``{"service": "/e_stop",
    "type": "std_srvs/Trigger"}`` is called."""
