"""The messages between the display and the gate, over the pipe.

Speeds are metres and radians per second in the robot's own frame (x forward, y left,
z up, turn counter-clockwise); times are seconds. The display makes up a short opaque
text for each robot, and one for each connection (the socket of one page).
"""

from typing import Literal

import msgspec

from webmap.gate.commands import ProgramCommand, Velocity

PROGRAM = "program"
"""The connection of the display's own Python code."""

Role = Literal["viewer", "operator", "admin"]

GoalMethod = Literal["topic", "navigate_to_pose", "move_base"]
"""How goals are sent: as PoseStamped on a topic, by the action of ROS 2, or by that of
ROS 1."""


Point = tuple[float, float]
"""In metres, in the robot's frame: x forward, y left."""


class AssistSpec(msgspec.Struct, frozen=True, kw_only=True):
    """How a robot is kept from what its scanner sees."""

    topic: str
    """Of ``sensor_msgs/LaserScan``."""
    footprint: tuple[Point, ...]
    """The corners of the robot in its own frame, in order, in metres."""
    sensor: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the scanner is on it: x, y in metres, yaw in radians."""
    upside_down: bool = False
    """Whether it hangs head down, so that its rays go round the other way."""
    frame: str = ""
    """The frame that its scans must name, without a leading slash; "" for any."""
    stop_distance: float = 0.15
    """What stays free before the robot, in metres."""
    brake: float = 0.5
    """How hard the robot slows down, in metres per second squared."""
    blind: Literal["stop", "creep"] = "stop"
    """What happens while the scan is old, empty or mostly unknown."""
    creep: float = 0.1
    """The speed of creeping, in metres per second."""


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


class Forget(msgspec.Struct, frozen=True, tag="forget"):
    """The robot is no longer wanted: stop it if it is driven, then drop it."""

    robot: str


class Connect(msgspec.Struct, frozen=True, tag="connect"):
    """A page opened its socket; the gate answers with :class:`Hello`."""

    connection: str
    name: str
    role: Role


class Disconnect(msgspec.Struct, frozen=True, tag="disconnect"):
    """The page's socket is gone: what it drove stops."""

    connection: str


class FromPage(msgspec.Struct, frozen=True, tag="browser"):
    """A page's own words, not looked at by the display."""

    connection: str
    text: bytes


class Speeds(msgspec.Struct, frozen=True, tag="speeds"):
    """The greatest speeds that a page's ``Teleop`` asks for."""

    connection: str
    v: float
    w: float


class Heartbeat(msgspec.Struct, frozen=True, tag="beat"):
    """The display lives; sent every 50 ms."""


class WriterNodes(msgspec.Struct, frozen=True, tag="writer-nodes"):
    """Which nodes besides the bridge publish to a robot's velocity topic."""

    robot: str
    nodes: tuple[str, ...]


class FromProgram(msgspec.Struct, frozen=True, tag="program"):
    """A command of the display's Python code; its ``seq`` is not checked."""

    command: ProgramCommand
    request: int = 0
    """Number of a ``Take``, which :class:`TakeReply` answers."""


ToGate = (
    RobotSpec
    | Forget
    | Connect
    | Disconnect
    | FromPage
    | Speeds
    | Heartbeat
    | WriterNodes
    | FromProgram
)


class Holder(msgspec.Struct, frozen=True):
    """Who holds the lease of a robot."""

    connection: str
    name: str


class AskerReport(msgspec.Struct, frozen=True):
    """Who asks the holder of a robot's lease for it."""

    connection: str
    name: str
    left: float
    """Seconds until it is granted by itself."""


class StopReport(msgspec.Struct, frozen=True):
    """What is known of a STOP that stands."""

    by: str
    """Who said it, for people."""
    confirmed: bool | None
    """Whether odometry shows standstill; ``None`` while that is not known yet."""
    why: str
    """The reason in words."""
    id: str
    """Its identity, which a reset must name. Each press of STOP has its own."""


class TestReport(msgspec.Struct, frozen=True):
    """How it stands with the last stop test."""

    state: Literal["creeping", "waiting", "done", "failed"]
    text: str


class GoalReport(msgspec.Struct, frozen=True, kw_only=True):
    """How it stands with the newest goal; what the robot does not say is ``None``."""

    id: str
    x: float
    y: float
    yaw: float
    by: str
    """The connection that sent it."""
    way: GoalMethod
    state: Literal[
        "sent",
        "accepted",
        "under way",
        "cancelling",
        "unknown",
        "reached",
        "failed",
        "cancelled",
    ]
    """``unknown``: what told how it goes was lost, and the robot may go on."""
    why: str = ""
    """Why it is so, in words."""
    left: float | None = None
    """Metres to go; along the path, or as the crow flies where move_base tells."""
    time: float | None = None
    """Seconds under way."""
    eta: float | None = None
    """Seconds to go."""
    recoveries: int | None = None
    """How often the robot had to free itself."""


Activity = Literal[
    "stopped",
    "unconfirmed",
    "down",
    "changing",
    "other",
    "stopping",
    "blocked",
    "driven",
    "navigating",
    "navigating_held",
    "settling",
    "moving",
    "held",
    "free",
    "barred",
    "barred_held",
]
"""What a robot does, as far as the gate knows."""


class RobotReport(msgspec.Struct, frozen=True, kw_only=True, tag="robot"):
    """Everything a page shows about a robot's motion."""

    robot: str
    name: str
    state: Literal["free", "held", "driving", "stopping", "stopped"]
    """``stopping``: zeros are being sent; ``stopped``: STOP stands."""
    doing: Activity
    """The same in the words of an operator, see ``webmap.core.robot_state``."""
    latched: bool
    """Whether STOP stands, and will after a restart: until a reset nothing moves."""
    stop: StopReport | None
    """What became of the STOP that stands."""
    holder: Holder | None
    epoch: int | None
    """The epoch of the lease, which commands must name; ``None`` without a lease."""
    asker: AskerReport | None
    changing: bool
    """Whether the lease goes to somebody else as soon as the robot stands."""
    armed: bool
    """Whether a command to move would be taken now."""
    v: float
    w: float
    """The speeds in force. Of a robot that nobody has, those that it allows: infinity
    if none was stated, for who takes it brings a limit along."""
    why: tuple[str, ...]
    """What holds the speeds down, in words."""
    link: Literal["up", "down"]
    sent: Velocity
    echoed: Velocity | None
    """What the robot's ROS last said back on the velocity topic."""
    measured: Velocity | None
    """What odometry says, if it is fresh."""
    alarm: str | None
    """That the robot moves on although zero was sent, in words."""
    age: float | None
    """The age of the driver's loop in milliseconds, p95 of two seconds."""
    reaction: float
    """Seconds from a finger to the robot, at worst."""
    brake: float
    """The deceleration that is assumed, in m/s²."""
    stop_time: float | None
    """Seconds within which the base stops by itself, if that is known."""
    stop_source: Literal["stated", "tested"] | None
    stop_date: str | None
    """The day of the stop test."""
    test: TestReport | None
    armable: bool
    reason: str | None
    """Why the robot cannot be taken or moved now, in words."""
    way: GoalMethod | None = None
    """How goals are sent to it, ``None`` if none can be."""
    cancels: bool = False
    """Whether they can be called off."""
    locates: bool = False
    """Whether it can be told where it is."""
    goal: GoalReport | None = None
    """The newest goal of this gate, also when it has ended."""
    other_writer: str | None = None
    """That another program publishes velocities to it, which and from where, in
    words."""
    hooks: tuple[str, ...] = ()
    """Which stop hooks failed, or have not been said yet, and why, in words."""


class RobotGone(msgspec.Struct, frozen=True, tag="gone"):
    """The robot was forgotten."""

    robot: str


class Ready(msgspec.Struct, frozen=True, tag="ready"):
    """The gate's process runs and listens."""

    pid: int


class Hello(msgspec.Struct, frozen=True, tag="hello"):
    """The gate knows the connection now."""

    connection: str


class Tick(msgspec.Struct, frozen=True, tag="tick"):
    """The number that commands must echo, at 20 Hz."""

    tick: int
    acks: dict[str, int]
    """The newest accepted ``seq`` of each connection, -1 at first."""


class Refused(msgspec.Struct, frozen=True, tag="refused"):
    """A command was not taken."""

    connection: str
    robot: str | None
    what: str
    why: str


class RefusedCount(msgspec.Struct, frozen=True, tag="refused-count"):
    """How much of what somebody sent was refused since that was last counted."""

    by: str
    """Who sent it, for people."""

    count: int
    last: str
    """What was refused last, and why."""


class CloseConnection(msgspec.Struct, frozen=True, tag="close"):
    """The display should close this page's socket: it talks nonsense."""

    connection: str
    why: str


class TakeReply(msgspec.Struct, frozen=True, tag="take-reply"):
    """The answer to :class:`FromProgram` with a ``Take``."""

    request: int
    robot: str
    epoch: int | None
    why: str | None


class SentTwist(msgspec.Struct, frozen=True, tag="sent-twist"):
    """A velocity was written to the robot's bridge."""

    robot: str
    vx: float
    vy: float
    wz: float
    by: str | None
    """The connection that gave it; ``None`` for a zero that the gate sent itself."""
    vz: float = 0.0
    wx: float = 0.0
    wy: float = 0.0


class SentGoal(msgspec.Struct, frozen=True, tag="sent-goal"):
    """A goal was written to the robot's bridge."""

    robot: str
    x: float
    y: float
    yaw: float
    by: str


class SentPose(msgspec.Struct, frozen=True, tag="sent-pose"):
    """The robot was told where it is."""

    robot: str
    x: float
    y: float
    yaw: float
    by: str


class GateUp(msgspec.Struct, frozen=True, tag="up"):
    """The gate's process runs (made by the client)."""


class GateDown(msgspec.Struct, frozen=True, tag="down"):
    """The gate's process is gone: every lease and tick with it (by the client)."""

    why: str
    failing: bool = False
    """Whether one gate after the other ends, so that somebody must do something."""


FromGate = (
    Ready
    | Hello
    | Tick
    | RobotReport
    | RobotGone
    | Refused
    | RefusedCount
    | CloseConnection
    | TakeReply
    | SentTwist
    | SentGoal
    | SentPose
)

Report = (
    RobotReport
    | RobotGone
    | Refused
    | RefusedCount
    | SentTwist
    | SentGoal
    | SentPose
    | GateUp
    | GateDown
)
