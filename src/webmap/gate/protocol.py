"""The messages between the display and the gate, over the pipe.

Speeds are metres and radians per second in the robot's own frame (x forward, y left,
z up, turn counter-clockwise); times are seconds. The display generates a short opaque
id for each robot and for each connection (the socket of one page).
"""

from typing import Annotated, Literal

import msgspec

from webmap.base.roles import Role
from webmap.config.motion import (
    TWIST_TYPES,
    InitialPoseConfig,
    MotionConfig,
    MoveConfig,
    TwistConfig,
)
from webmap.gate.commands import ProgramCommand, Velocity

PROGRAM = "program"
"""The connection of the display's own Python code."""


class Identity(
    msgspec.Struct, frozen=True, omit_defaults=True, repr_omit_defaults=True
):
    """The person behind a name, and the page: names may be equal, and may change.

    It only tells pages whose a command was. No decision depends on it.
    """

    person: Annotated[str, msgspec.Meta(max_length=128)]
    """The same for all pages of one person."""
    page: Annotated[str, msgspec.Meta(max_length=32)] = ""
    verified: bool = False
    """Whether a sign-in has verified the name of the person."""


GoalMethod = Literal["topic", "navigate_to_pose", "move_base"]
"""How goals are sent: as PoseStamped on a topic, to the action of ROS 2, or to that of
ROS 1."""


_NO_BASE = TwistConfig(topic="")
_NO_NAVIGATION = MoveConfig()


class RobotSpec(MotionConfig, kw_only=True, frozen=True, tag="declare"):
    """The declaration of a robot. Sent again, it replaces the earlier declaration.

    It has the parts of a robot's configuration that move it, each with the address of
    its bridge. If bridge and velocity topic stay the same and any other value changes,
    the lease on the robot ends.
    """

    id: str
    name: str
    """A label for people; need not be unique."""
    base_frame: str = ""
    """The robot's own frame, which a TwistStamped names."""
    twist_type_assumed: bool = False
    """Whether the type of its velocity is a default: a type that another robot states
    overrides it."""
    odometry_topic: str | None = None
    odometry_type: str | None = None
    odometry_url: str | None = None
    """The bridge of the odometry, if it is a different one."""
    own_map: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """The origin of its goal frame on the common map: metres and radians. Goals and
    poses arrive on the common map, and are sent to the robot in its own map."""

    @property
    def base(self) -> TwistConfig:
        """Where velocity goes, and the limits; empty if the robot takes no velocity."""
        return self.twist or _NO_BASE

    @property
    def twist_type(self) -> str:
        """The type of its velocity."""
        return self.base.type or TWIST_TYPES[0]

    @property
    def navigation(self) -> MoveConfig:
        """Where goals go; empty if the robot takes none."""
        return self.move or _NO_NAVIGATION

    @property
    def goal_part(self) -> MoveConfig | InitialPoseConfig | None:
        """The part with the bridge and the frame of goals and of the initial pose."""
        return self.move or self.initial_pose

    @property
    def bridge_url(self) -> str:
        """The bridge that velocity goes to, or else goals; empty if nothing does."""
        part = self.twist or self.goal_part
        return "" if part is None else part.bridge

    @property
    def goal_url(self) -> str:
        """The bridge of goals, cancels and the initial pose."""
        return self.bridge_url if self.goal_part is None else self.goal_part.bridge

    @property
    def goal_frame(self) -> str:
        """The frame of goals and of the initial pose."""
        return "map" if self.goal_part is None else self.goal_part.frame

    def goal_type(self, name: str) -> str:
        """Return a type of ``geometry_msgs`` in the form of the action's dialect."""
        ros2 = self.navigation.action and "/action/" in self.navigation.action_type
        return f"geometry_msgs/msg/{name}" if ros2 else f"geometry_msgs/{name}"


class Forget(msgspec.Struct, frozen=True, tag="forget"):
    """Remove the robot; if it is driven, stop it first."""

    robot: str


class Connect(
    msgspec.Struct,
    frozen=True,
    tag="connect",
    omit_defaults=True,
    repr_omit_defaults=True,
):
    """A page opened its socket; the gate answers with :class:`Hello`."""

    connection: str
    name: str
    role: Role
    program: bool = False
    """Whether it is not a page but the Python code of another display."""
    identity: Identity | None = None
    """None for a program."""


class Rename(msgspec.Struct, frozen=True, tag="rename"):
    """The person at a page has another name now; nothing else changes."""

    connection: str
    name: str


class Disconnect(msgspec.Struct, frozen=True, tag="disconnect"):
    """The page or program is gone: the robots that it drives stop."""

    connection: str


class FromPage(msgspec.Struct, frozen=True, tag="from_page"):
    """A message of a page, which the display does not read."""

    connection: str
    text: bytes


class Speeds(msgspec.Struct, frozen=True, tag="speeds"):
    """The speed limits that a page's ``Teleop`` asks for."""

    connection: str
    v: float
    w: float


class Heartbeat(msgspec.Struct, frozen=True, tag="beat"):
    """The display responds; sent every 50 ms."""


class WriterNodes(msgspec.Struct, frozen=True, tag="writer-nodes"):
    """Which nodes besides the bridge publish to a robot's velocity topic."""

    robot: str
    nodes: tuple[str, ...]


class FromProgram(
    msgspec.Struct,
    frozen=True,
    tag="from_program",
    omit_defaults=True,
    repr_omit_defaults=True,
):
    """A command of a display's Python code; its ``seq`` is not checked."""

    command: ProgramCommand
    request: int = 0
    """Number of a ``Take``, which :class:`TakeReply` answers."""
    connection: str = PROGRAM


ToGate = (
    RobotSpec
    | Forget
    | Connect
    | Rename
    | Disconnect
    | FromPage
    | Speeds
    | Heartbeat
    | WriterNodes
    | FromProgram
)


class Holder(msgspec.Struct, frozen=True, omit_defaults=True, repr_omit_defaults=True):
    """The connection that has control of a robot, and its name for people."""

    connection: str
    name: str
    identity: Identity | None = None


class AskerReport(
    msgspec.Struct, frozen=True, omit_defaults=True, repr_omit_defaults=True
):
    """The connection that requests control of a robot from its holder."""

    connection: str
    name: str
    left: float
    """Seconds until the request is granted automatically."""
    identity: Identity | None = None


class StopReport(
    msgspec.Struct, frozen=True, omit_defaults=True, repr_omit_defaults=True
):
    """Who pressed an active STOP, and whether the robot stands."""

    by: str
    """The name of who pressed STOP."""
    confirmed: bool | None
    """Whether odometry shows standstill; ``None`` while that is not known yet."""
    why: str
    """The reason as text."""
    id: str
    """The identity of the newest press, which a reset must name."""
    identity: Identity | None = None
    """That of the person; None for a program, or if it is unknown."""


class TestReport(msgspec.Struct, frozen=True):
    """The state of the last stop test."""

    state: Literal["creeping", "waiting", "done", "failed"]
    text: str


class CheckReport(msgspec.Struct, frozen=True):
    """The newest check before driving."""

    every: float | None
    """Seconds after which the next one is due; ``None`` if none is demanded."""
    by: str = ""
    """The name of the person who made it; empty if there was none."""
    at: float | None = None
    """When, in seconds since 1970, by the clock of the gate's computer."""


class GoalReport(msgspec.Struct, frozen=True, kw_only=True):
    """The state of the newest goal; unreported values are ``None``."""

    id: str
    x: float
    y: float
    yaw: float
    by: str
    """The connection that sent it."""
    method: GoalMethod
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
    """``unknown``: the source of progress was lost, or the robot never answered; it may
    follow the goal, or not."""
    why: str = ""
    """The reason for the state, as text."""
    left: float | None = None
    """Metres to go: along the path, or in a straight line with move_base."""
    time: float | None = None
    """Seconds since the robot began."""
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
"""The states of a robot, see ``webmap.core.robot_state``."""


class RobotReport(msgspec.Struct, frozen=True, kw_only=True, tag="robot"):
    """Everything that a page shows about a robot's motion."""

    robot: str
    name: str
    state: Literal["free", "held", "driving", "stopping", "stopped"]
    """``stopping``: zeros are being sent; ``stopped``: STOP is active."""
    doing: Activity
    """What the robot does, in the terms of an operator."""
    latched: bool
    """Whether STOP is active, also after a restart: nothing moves until a reset."""
    stop: StopReport | None
    """The active STOP."""
    holder: Holder | None
    epoch: int | None
    """The epoch of the lease, which commands must name; ``None`` without a lease."""
    asker: AskerReport | None
    changing: bool
    """Whether the lease changes to another connection at standstill."""
    armed: bool
    """Whether a command to move would be accepted now."""
    v: float
    w: float
    """The speed limits in force. For a free robot its own limits: infinity if none was
    stated, because the page that takes control adds its limit."""
    why: tuple[str, ...]
    """The reasons for the speed limits, as text."""
    link: Literal["up", "down"]
    sent: Velocity
    echoed: Velocity | None
    """The velocity last received on the velocity topic."""
    measured: Velocity | None
    """The velocity in the newest odometry, if it is fresh."""
    alarm: str | None
    """That the robot still moves although zero was sent, as text; or
    :data:`MAY_MOVE`."""
    age: float | None
    """The age of the driver's loop in milliseconds, p95 of two seconds."""
    reaction: float
    """Seconds from an input to the robot, in the worst case."""
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
    """Why the robot cannot be taken or moved now, as text."""
    method: GoalMethod | None = None
    """The method for goals; ``None`` if goals cannot be sent."""
    cancels: bool = False
    """Whether goals can be cancelled."""
    locates: bool = False
    """Whether the robot takes an initial pose."""
    goal: GoalReport | None = None
    """The newest goal of this gate, also when it has ended."""
    other_writer: str | None = None
    """That another program publishes velocities to the robot: which velocity and which
    nodes, as text."""
    hooks: tuple[str, ...] = ()
    """Which stop hooks failed or were not sent yet, and why, as text."""
    check: CheckReport | None = None
    """The newest check before driving, if there was one or one is demanded."""


MAY_MOVE = (
    "may still be moving. Only the base's own timeout or the button on the robot can "
    "stop it"
)
"""The alarm about a driven robot without a known timeout that gets no zero (S21)."""


class RobotGone(msgspec.Struct, frozen=True, tag="gone"):
    """The gate has forgotten the robot; no report of it follows."""

    robot: str


class Ready(msgspec.Struct, frozen=True, tag="ready"):
    """The gate's process runs and reads its pipe."""

    pid: int


class Hello(msgspec.Struct, frozen=True, tag="hello"):
    """The answer to :class:`Connect`: the gate accepts messages of the connection."""

    connection: str


class Tick(msgspec.Struct, frozen=True, tag="tick"):
    """The number that commands must echo, at 20 Hz."""

    tick: int
    acks: dict[str, int]
    """The newest accepted ``seq`` of each connection, -1 at first."""


class Refused(msgspec.Struct, frozen=True, tag="refused"):
    """A command was not executed; its page or its program gets the reason."""

    connection: str
    robot: str | None
    what: str
    why: str


class RefusedCount(msgspec.Struct, frozen=True, tag="refused-count"):
    """The number of messages of one sender that were refused since the last count."""

    by: str
    """The name of the sender."""

    count: int
    last: str
    """The last refused message, and why."""


class CloseConnection(msgspec.Struct, frozen=True, tag="close"):
    """The display should close this page's socket: the page sends invalid messages."""

    connection: str
    why: str


class TakeReply(
    msgspec.Struct,
    frozen=True,
    tag="take-reply",
    omit_defaults=True,
    repr_omit_defaults=True,
):
    """The answer to :class:`FromProgram` with a ``Take``."""

    request: int
    robot: str
    epoch: int | None
    why: str | None
    connection: str = PROGRAM
    """The program that sent it; each numbers its own requests."""


class SentTwist(msgspec.Struct, frozen=True, tag="sent-twist"):
    """A velocity was written to the robot's bridge."""

    robot: str
    vx: float
    vy: float
    wz: float
    by: str | None
    """The connection that sent it; ``None`` for a zero of the gate itself."""
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
    """An initial pose was written to the robot's bridge."""

    robot: str
    x: float
    y: float
    yaw: float
    by: str


class GateUp(msgspec.Struct, frozen=True, tag="up"):
    """The gate's process runs (made by the client)."""


class GateDown(msgspec.Struct, frozen=True, tag="down"):
    """The gate's process has ended, with all leases and ticks (made by the client)."""

    why: str
    failing: bool = False
    """Whether one gate after the other ends, so that a person must find the cause."""


class LeaseEnded(msgspec.Struct, frozen=True, tag="lease-ended"):
    """Control of a robot has ended, other than by a release (made by the client)."""

    robot: str
    why: str


class PageAsked(msgspec.Struct, frozen=True, tag="asked"):
    """A page of this display asks to end a STOP or a goal (made by the client).

    The next reports show whether it has ended.
    """

    robot: str
    op: Literal["reset", "cancel"]
    name: str
    """Empty if the gate has refused it."""
    identity: Identity | None


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
    | LeaseEnded
    | PageAsked
    | GateUp
    | GateDown
)
