"""The actions that the rules send to the shell."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from webmap.base.geometry import Twist
from webmap.config.motion import StopHook
from webmap.gate.events import Key, Press
from webmap.gate.protocol import FromGate, GoalMethod, RobotSpec


@dataclass(frozen=True, slots=True)
class Attach:
    """Keep the sockets of this robot open; a second one replaces the first."""

    key: Key
    spec: RobotSpec


@dataclass(frozen=True, slots=True)
class Detach:
    """Close the robot's sockets if no other robot needs them."""

    key: Key
    robot: str


@dataclass(frozen=True, slots=True)
class Watch:
    """Subscribe to the machine's echo and odometry, or unsubscribe."""

    key: Key
    on: bool


@dataclass(frozen=True, slots=True)
class PingOften:
    """Ping the links of a watched machine often, as :class:`Watch` begins, or not."""

    key: Key
    on: bool


@dataclass(frozen=True, slots=True)
class WriteTwist:
    """Write a velocity now or drop it; answered by ``TwistWritten``.

    Zero is written whenever the link is open. Any other velocity is written only if no
    earlier data waits to be sent, and only until ``until``.
    """

    key: Key
    twist: Twist
    epoch: int | None
    by: str | None
    until: float = math.inf
    """When it is too old, by the gate's clock: the process may have been delayed
    between the decision and the write."""


@dataclass(frozen=True, slots=True)
class SendGoal:
    """Write a goal now or drop it; answered by ``GoalWritten``."""

    key: Key
    robot: str
    id: str
    x: float
    y: float
    yaw: float
    by: str
    method: GoalMethod
    until: float = math.inf
    """When it is too old, by the gate's clock."""


@dataclass(frozen=True, slots=True)
class SendPose:
    """Write an initial pose now or drop it; answered by ``PoseWritten``."""

    key: Key
    robot: str
    x: float
    y: float
    yaw: float
    by: str
    until: float = math.inf
    """When it is too old, by the gate's clock."""


@dataclass(frozen=True, slots=True)
class CancelGoals:
    """Cancel every goal of the robot, by every method that it has."""

    key: Key
    robot: str


@dataclass(frozen=True, slots=True)
class CutLink:
    """Abort the control socket, discard its unsent data, and reconnect."""

    url: str


@dataclass(frozen=True, slots=True)
class Lock:
    """Try to lock the machine for this gate; answered by ``LockState``."""

    key: Key


@dataclass(frozen=True, slots=True)
class Unlock:
    """Release the lock of the machine for other gates."""

    key: Key


@dataclass(frozen=True, slots=True)
class MarkDriven:
    """Save on disk whether the machine is driven (S13)."""

    key: Key
    driven: bool


@dataclass(frozen=True, slots=True)
class SaveStop:
    """Save on disk that STOP is active, or (``press`` is ``None``) that it is not.

    Answered by ``StopSaved`` when the disk has it; nothing waits for that.
    """

    key: Key
    number: int
    press: Press | None
    ids: frozenset[str]
    """The presses that this gate may have written to the file. If the file has any
    other press, another gate received STOP meanwhile, and the file is not removed."""


@dataclass(frozen=True, slots=True)
class SaveStopTest:
    """Save the result of a stop test; answered by ``StopTestSaved``."""

    key: Key
    seconds: float | None
    error: float = 0.0
    """Seconds by which that may be too long."""


@dataclass(frozen=True, slots=True)
class SaveCheck:
    """Save that a person checked the machine; answered by ``CheckSaved``."""

    key: Key
    by: str


@dataclass(frozen=True, slots=True)
class RunHook:
    """Publish ``stopped`` as the Bool of a stop hook, or call its service.

    Answered by ``HookEnded``, for a service after its answer or its timeout; nothing
    waits for that.
    """

    key: Key
    robot: str
    hook: StopHook
    stopped: bool
    number: int


@dataclass(frozen=True, slots=True)
class SendToDisplay:
    """Put a message into the pipe to the display, after those that wait there."""

    message: FromGate


Action = (
    Attach
    | Detach
    | Watch
    | PingOften
    | WriteTwist
    | SendGoal
    | SendPose
    | CancelGoals
    | CutLink
    | Lock
    | Unlock
    | MarkDriven
    | SaveStop
    | SaveStopTest
    | SaveCheck
    | RunHook
    | SendToDisplay
)

Emit = Callable[[Action], None]
