"""What the decisions ask of the shell."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from webmap.base.geometry import Twist
from webmap.gate.events import Key, Press
from webmap.gate.protocol import FromGate, GoalMethod, RobotSpec


@dataclass(frozen=True, slots=True)
class Attach:
    """Hold the sockets of this robot open; sent again, it replaces the earlier one."""

    key: Key
    spec: RobotSpec


@dataclass(frozen=True, slots=True)
class Detach:
    """The robot's sockets are no longer needed."""

    key: Key
    robot: str


@dataclass(frozen=True, slots=True)
class Watch:
    """Listen to the machine's echo and odometry, or no longer."""

    key: Key
    on: bool


@dataclass(frozen=True, slots=True)
class WriteTwist:
    """Write a velocity now or drop it; answered by ``TwistWritten``.

    Zero is written whenever the link is open. Anything else is written only if
    nothing is waiting to be sent before it, and before it is too old.
    """

    key: Key
    twist: Twist
    epoch: int | None
    by: str | None
    until: float = math.inf
    """When it is too old, by the gate's clock: the process may have been held up
    between what was decided and what is written."""


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
    way: GoalMethod
    until: float = math.inf
    """When it is too old, by the gate's clock."""


@dataclass(frozen=True, slots=True)
class SendPose:
    """Tell the robot where it is, now or not at all; answered by ``PoseWritten``."""

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
    """Cancel every goal of the robot, by every way that it has."""

    key: Key
    robot: str


@dataclass(frozen=True, slots=True)
class CutLink:
    """Throw the control socket away with all that it has not sent, and reconnect."""

    url: str


@dataclass(frozen=True, slots=True)
class Lock:
    """Try to have the machine for this gate alone; answered by ``LockState``."""

    key: Key


@dataclass(frozen=True, slots=True)
class Unlock:
    """Let other gates have the machine."""

    key: Key


@dataclass(frozen=True, slots=True)
class MarkDriven:
    """Keep on disk whether the machine is being driven (S13)."""

    key: Key
    driven: bool


@dataclass(frozen=True, slots=True)
class SaveStop:
    """Keep on disk that STOP stands, or (``press`` is ``None``) that it does not.

    Answered by ``StopSaved`` when the disk has it; nothing waits for that.
    """

    key: Key
    number: int
    press: Press | None
    ids: frozenset[str]
    """The presses that may be in the file by this gate's doing. If another one is
    there, another gate was told STOP meanwhile, and the file is not taken away."""


@dataclass(frozen=True, slots=True)
class SaveStopTest:
    """Keep what a stop test found; answered by ``StopTestSaved``."""

    key: Key
    seconds: float | None


@dataclass(frozen=True, slots=True)
class RunHook:
    """Publish the robot's Bool (``stopped``), or call its service.

    Answered by ``HookEnded``, for a service when it has answered or did not in time;
    nothing waits for that.
    """

    key: Key
    robot: str
    hook: dict[str, str]
    stopped: bool
    number: int


@dataclass(frozen=True, slots=True)
class SendToDisplay:
    """Tell the display."""

    message: FromGate


Action = (
    Attach
    | Detach
    | Watch
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
    | RunHook
    | SendToDisplay
)

Emit = Callable[[Action], None]
