"""Everything that moves a robot: velocity, goals, limits, stop hooks, scan assist.

The gate gets a robot in this form too, and reads it with the same checks. It needs no
display, so a process that only moves robots can import it.
"""

import math
from numbers import Real
from typing import Annotated, Any, ClassVar, Literal

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.outline import Point, polygon_around, why_no_outline
from webmap.config import checks
from webmap.config.checks import KeyPath, Mistakes
from webmap.config.reading import Config
from webmap.ros.names import normalise_topic

TWIST_TYPES = ("geometry_msgs/Twist", "geometry_msgs/TwistStamped")
"""The message types for velocities."""

NAVIGATE_TO_POSE = "nav2_msgs/action/NavigateToPose"
MOVE_BASE = "move_base_msgs/MoveBaseAction"

COVARIANCE = (0.25, 0.25, 0.068)
"""RViz's default: half a metre in x and y, and 15 degrees."""

LEAST = 1e-3
"""The least limit of an axis out of the plane and of the acceleration, in SI units."""

_SQUARED = "metres per second squared"


def _limit(unit: str) -> checks.Check:
    """Return a check for a limit that a robot can notice."""

    def check(value: Any) -> float:
        number = float(checks.above_zero(unit)(value))
        if number < LEAST:
            raise ConfigError(f"a number of {unit} from {LEAST:g} on")
        return number

    return check


class TopicConfig(Config, frozen=True):
    """A table that may be written as its topic's name alone."""

    @classmethod
    def expand(cls, value: Any) -> dict[str, Any]:
        """Return the table for a topic alone."""
        return {"topic": value}


_hook_name = checks.expecting('a name, such as "/lock"', normalise_topic)

_covariance = checks.expecting(
    "three numbers from 0 on: the variances of x and y in m², of yaw in rad², such as "
    "[0.25, 0.25, 0.068]",
    checks.numbers(3, checks.from_zero("m²")),
)


def _size(value: Any) -> float | list[Point]:
    if isinstance(value, Real):
        return float(checks.above_zero("metres")(value))
    corner = checks.numbers(2, checks.finite("a number of metres"))
    corners = [corner(each) for each in checks.items(value)]
    if len(corners) < 3:
        raise ConfigError("3 corners or more")
    return [(x, y) for x, y in corners]


_footprint = checks.expecting(
    "the robot's radius in metres, above 0, or 3 corners of its outline or more, such "
    "as [[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]]",
    _size,
)


class StopHook(Config, kw_only=True, frozen=True, repr_omit_defaults=True):
    """What else is sent over the robot's bridge on STOP."""

    example: ClassVar[str] = '{topic = "/lock"} or {service = "/e_stop"}'

    topic: Annotated[str, _hook_name] = ""
    """A topic of type ``std_msgs/Bool``: true is published, and false on Reset."""
    service: Annotated[str, _hook_name] = ""
    """A service of type ``std_srvs/Trigger``, which is called."""
    type: Annotated[str, checks.text] = ""

    @property
    def name(self) -> str:
        """The name of the topic or of the service."""
        return self.topic or self.service

    def __post_init__(self) -> None:
        if not self.type:
            type = "std_msgs/Bool" if self.topic else "std_srvs/Trigger"
            msgspec.structs.force_setattr(self, "type", type)

    def check(self, path: KeyPath, mistakes: Mistakes) -> None:
        """Add mistakes that concern several fields."""
        if bool(self.topic) == bool(self.service):
            message = 'expected the key "topic" or the key "service", one of them'
            mistakes.add(path, message)
            return
        allowed = "std_msgs/Bool" if self.topic else "std_srvs/Trigger"
        checks.checked(
            checks.message_type(allowed), self.type, (*path, "type"), mistakes
        )


class TwistConfig(TopicConfig, kw_only=True, frozen=True):
    """The topic for velocity, and the limits of the base."""

    topic: Annotated[str, checks.topic]
    type: Annotated[str, checks.message_type(*TWIST_TYPES)] | None = None
    """If not given, the bridge is queried, and Twist is assumed."""
    stops_within: Annotated[float, checks.above_zero("seconds")] | None = None
    """The command timeout of the base, if known."""
    v_max: Annotated[float, checks.from_zero("metres per second")] | None = None
    """The greatest speed, in any direction."""
    w_max: Annotated[float, checks.from_zero("radians per second")] | None = None
    """The greatest rate of turn, about any axis."""
    z_max: Annotated[float, _limit("metres per second")] | None = None
    """The greatest speed upward and downward; without it the robot takes no ``z``."""
    rx_max: Annotated[float, _limit("radians per second")] | None = None
    """The greatest rate of turn about the forward axis; without it, no ``rx``."""
    ry_max: Annotated[float, _limit("radians per second")] | None = None
    """The greatest rate of turn about the left axis; without it, no ``ry``."""
    a_max: Annotated[float, _limit(_SQUARED)] | None = None
    """The greatest acceleration; it never delays slowing down."""
    check_every: Annotated[float, checks.duration] | None = None
    """Seconds after a check before driving until the next one is due; without it the
    robot drives slowly."""
    holonomic: bool = False
    """Whether the base can move sideways."""
    drive_without_proof: bool = False
    """Whether the robot may be moved through an old ``foxglove_bridge``, which any of
    its clients can stall, and which does not show what has arrived."""
    stop_hooks: list[StopHook] = []
    bridge: str = ""

    def check(self, path: KeyPath, mistakes: Mistakes) -> None:
        """Add mistakes that concern several fields."""
        for index, hook in enumerate(self.stop_hooks):
            if self.topic in (hook.topic, hook.service):
                message = f"{self.topic} is the velocity topic, expected another name"
                mistakes.add((*path, "stop_hooks", index), message)


class MoveConfig(TopicConfig, kw_only=True, frozen=True):
    """Where goals go, and how one is cancelled."""

    action: Annotated[str, checks.topic] | None = None
    """The action for goals, which reports their progress and their end."""
    action_type: Annotated[
        str,
        checks.message_type(
            "nav2_msgs/NavigateToPose", "move_base_msgs/MoveBaseAction"
        ),
    ] = NAVIGATE_TO_POSE
    topic: Annotated[str, checks.topic] = ""
    """A topic of type ``geometry_msgs/PoseStamped``; together with an action it is for
    bridges that take no goals of actions."""
    cancel_topic: Annotated[str, checks.topic] | None = None
    """The topic of actionlib that cancels goals."""
    frame: Annotated[str, checks.text] = "map"
    """The frame of the goals."""
    on_operator_loss: Annotated[str, checks.one_of("continue", "cancel")] = "continue"
    """Whether a goal continues or is cancelled when its operator is lost."""
    bridge: str = ""

    def check(self, path: KeyPath, mistakes: Mistakes) -> None:
        """Add mistakes that concern several fields."""
        if not self.topic and not self.action:
            missing = 'the key "topic" is missing'
            message = "goals go to a topic or to an action, and neither is given"
            mistakes.add(path, f"{missing}: {message}")


class InitialPoseConfig(TopicConfig, kw_only=True, frozen=True):
    """The topic for the robot's initial pose, and how certain that pose is."""

    topic: Annotated[str, checks.topic]
    """A topic of type ``geometry_msgs/PoseWithCovarianceStamped``."""
    covariance: Annotated[tuple[float, float, float], _covariance] = COVARIANCE
    """The variances of x and y in m², and of yaw in rad²."""
    frame: Annotated[str, checks.text] = "map"
    """The map frame of the pose; used if the robot takes no goals."""
    bridge: str = ""


class ScanAssistConfig(Config, kw_only=True, frozen=True):
    """Scan assist: slows the robot down before obstacles in its scan."""

    topic: Annotated[str, checks.topic]
    """A topic of type ``sensor_msgs/LaserScan``, on the bridge of the velocity."""
    footprint: Annotated[float | list[Point], _footprint]
    """The robot's radius, or its corners in its own frame, in order, in metres."""
    x: Annotated[float, checks.finite("a number of metres")] = 0.0
    """The scanner's position, forward of the base."""
    y: Annotated[float, checks.finite("a number of metres")] = 0.0
    """The scanner's position, left of the base."""
    angle: Annotated[float, checks.finite("a number of degrees")] = 0.0
    """The scanner's direction, counter-clockwise from the robot's x."""
    upside_down: bool = False
    """Whether the scanner is mounted upside down, so that its rays turn the other
    path."""
    frame: Annotated[str, checks.frame] = ""
    """The frame that the scans must have; any if empty."""
    stop_distance: Annotated[float, checks.from_zero("metres")] = 0.15
    """The distance that stays free before the robot."""
    brake: Annotated[float, checks.above_zero(_SQUARED)] = 0.5
    """The deceleration of the robot."""
    blind: Literal["stop", "creep"] = "stop"
    """Whether the robot stops or creeps while the scan is stale, empty or mostly
    unknown."""
    creep: Annotated[float, checks.from_zero("metres per second")] = 0.1
    """The speed when creeping."""

    @property
    def sensor(self) -> tuple[float, float, float]:
        """The pose of the scanner on the robot: x, y in metres, yaw in radians."""
        return (self.x, self.y, math.radians(self.angle))

    @property
    def corners(self) -> tuple[Point, ...]:
        """The corners of the robot, around its disc if the footprint is a radius."""
        size = self.footprint
        return polygon_around(size) if isinstance(size, float) else tuple(size)

    def check(self, path: KeyPath, mistakes: Mistakes) -> None:
        """Add mistakes that concern several fields."""
        why = why_no_outline(self.corners)
        if why is not None:
            mistakes.add((*path, "footprint"), why)


class MotionConfig(Config, kw_only=True, frozen=True):
    """Everything that moves a robot; parts that it does not have are None.

    A part that uses a bridge may name one; otherwise it uses the robot's.
    """

    twist: TwistConfig | None = None
    move: MoveConfig | None = None
    initial_pose: InitialPoseConfig | None = None
    scan_assist: ScanAssistConfig | None = None

    def check(self, path: KeyPath, mistakes: Mistakes) -> None:
        """Add mistakes that concern several parts."""
        move, pose = self.move, self.initial_pose
        if move is not None and pose is not None and move.bridge != pose.bridge:
            mistakes.add(
                (*path, "initial_pose"),
                f"goals are sent to {move.bridge} and the initial pose to "
                f"{pose.bridge}, expected one bridge for both",
            )


MOTION = MotionConfig.__struct_fields__
"""The names of these parts, as in a robot's table."""

WRITING = ("twist", "move", "initial_pose")
"""The parts that the gate writes for; the first one of a robot sets its bridge."""
