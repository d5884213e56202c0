"""What the display and the gate say to each other over the pipe.

Speeds are metres and radians per second in the robot's own frame (x forward, y left,
z up, turn counter-clockwise); times are seconds. A robot is named by a short opaque
text that the display makes up; a connection (one page's socket) likewise.

``spec`` is what the display declares of a robot, with ``assist`` in it, ``to_gate``
what it says otherwise, ``robot_report`` what the gate tells of a robot, ``from_gate``
the rest of its words.
"""

from webmap.gate.messages.assist import AssistSpec, Point
from webmap.gate.messages.from_gate import (
    CloseConnection,
    FromGate,
    GateDown,
    GateUp,
    Hello,
    Ready,
    Refused,
    RefusedCount,
    Report,
    SentGoal,
    SentPose,
    SentTwist,
    TakeReply,
    Tick,
)
from webmap.gate.messages.robot_report import (
    AskerReport,
    Doing,
    GoalReport,
    Holder,
    RobotGone,
    RobotReport,
    StopReport,
    TestReport,
)
from webmap.gate.messages.spec import (
    RobotSpec,
)
from webmap.gate.messages.terms import (
    PROGRAM,
    Role,
    Velocity,
    Way,
)
from webmap.gate.messages.to_gate import (
    Connect,
    Disconnect,
    Forget,
    FromBrowser,
    Heartbeat,
    ProgramCancel,
    ProgramLocate,
    ProgramMove,
    ProgramRelease,
    ProgramTake,
    ProgramTwist,
    Reset,
    Speeds,
    Stop,
    ToGate,
    WriterNodes,
)

__all__ = [
    "PROGRAM",
    "AskerReport",
    "AssistSpec",
    "CloseConnection",
    "Connect",
    "Disconnect",
    "Doing",
    "Forget",
    "FromBrowser",
    "FromGate",
    "GateDown",
    "GateUp",
    "GoalReport",
    "Heartbeat",
    "Hello",
    "Holder",
    "Point",
    "ProgramCancel",
    "ProgramLocate",
    "ProgramMove",
    "ProgramRelease",
    "ProgramTake",
    "ProgramTwist",
    "Ready",
    "Refused",
    "RefusedCount",
    "Report",
    "Reset",
    "RobotGone",
    "RobotReport",
    "RobotSpec",
    "Role",
    "SentGoal",
    "SentPose",
    "SentTwist",
    "Speeds",
    "Stop",
    "StopReport",
    "TakeReply",
    "TestReport",
    "Tick",
    "ToGate",
    "Velocity",
    "Way",
    "WriterNodes",
]
