"""What the gate says to the display, and what the display's program hears of it."""

import msgspec

from webmap.gate.messages.robot_report import RobotGone, RobotReport


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
    """The answer to :class:`ProgramTake`."""

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
