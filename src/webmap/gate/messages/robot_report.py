"""Everything that the gate tells of one robot: its motion, its driver, its goal."""

from typing import Literal

import msgspec

from webmap.gate.messages.terms import Velocity, Way


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
    way: Way
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


Doing = Literal[
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
    doing: Doing
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
    way: Way | None = None
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
