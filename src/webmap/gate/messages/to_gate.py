"""What the display says to the gate."""

import msgspec

from webmap.gate.messages.spec import RobotSpec
from webmap.gate.messages.terms import Role, Velocity


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


class FromBrowser(msgspec.Struct, frozen=True, tag="browser"):
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


class Stop(msgspec.Struct, frozen=True, tag="stop"):
    """STOP from Python, for one robot or (``None``) for all."""

    robot: str | None = None


class Reset(msgspec.Struct, frozen=True, tag="reset"):
    """From Python: the STOP of a robot that has this identity stands no longer."""

    robot: str
    stop: str
    """As :class:`StopReport` tells it."""


class WriterNodes(msgspec.Struct, frozen=True, tag="writer-nodes"):
    """Which nodes besides the bridge publish to a robot's velocity topic."""

    robot: str
    nodes: tuple[str, ...]


class ProgramTake(msgspec.Struct, frozen=True, tag="program-take"):
    """Python asks for the lease; answered by :class:`TakeReply`."""

    request: int
    robot: str


class ProgramRelease(msgspec.Struct, frozen=True, tag="program-release"):
    """Python gives the lease back."""

    robot: str


class ProgramTwist(msgspec.Struct, frozen=True, tag="program-twist"):
    """One velocity from Python; it holds until the dead-man and is never repeated."""

    robot: str
    epoch: int
    tick: int
    velocity: Velocity


class ProgramMove(msgspec.Struct, frozen=True, tag="program-move"):
    """One goal from Python: metres and radians in the robot's ``goal_frame``."""

    robot: str
    epoch: int
    tick: int
    pose: tuple[float, float, float]


class ProgramLocate(msgspec.Struct, frozen=True, tag="program-locate"):
    """From Python: where the robot is, in metres and radians in its goal frame."""

    robot: str
    epoch: int
    tick: int
    pose: tuple[float, float, float]


class ProgramCancel(msgspec.Struct, frozen=True, tag="program-cancel"):
    """Python cancels the robot's goals; needs no lease."""

    robot: str


ToGate = (
    RobotSpec
    | Forget
    | Connect
    | Disconnect
    | FromBrowser
    | Speeds
    | Heartbeat
    | Stop
    | Reset
    | WriterNodes
    | ProgramTake
    | ProgramRelease
    | ProgramTwist
    | ProgramMove
    | ProgramLocate
    | ProgramCancel
)
