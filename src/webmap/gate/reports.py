"""What a page hears on ``/drive``: JSON objects, one in a text frame.

::

    {"op": "hello", "connection": "c5"}
    {"op": "tick", "tick": 812, "ack": 16}
    {"op": "robot", "robot": "r1", "name": "Bob", "state": "held",
     "holder": {"connection": "c5", "name": "Ann"}, "mine": true, "epoch": 3,
     "latched": false, "stop": null, "armed": false,
     "v": 1.0, "w": 1.5, "why": ["limit of the page"], "link": "up",
     "sent": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "echoed": null,
     "measured": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "alarm": null,
     "other_writer": null, "age": 42.0, "reaction": 0.492, "brake": 0.5,
     "stop_time": 0.25, "stop_source": "stated", "stop_date": null, "test": null,
     "armable": true, "reason": null, "way": "navigate_to_pose", "cancels": true,
     "locates": true, "goal": {"id": "g7", "x": 1.0, "y": 2.0, "yaw": 0.5, "by": "c5",
     "way": "navigate_to_pose", "state": "under way", "why": "", "left": 3.2,
     "time": 4.5, "eta": 5.3, "recoveries": 0}, "hooks": []}
    {"op": "gone", "robot": "r1"}
    {"op": "refused", "robot": "r1", "what": "take", "why": "Ann drives it"}

``hello`` comes first, also when the gate was started anew (all leases are then gone),
and after it every robot. ``tick`` comes at 20 Hz; ``ack`` is the newest accepted
``seq`` of this connection, -1 at first. ``robot`` comes when something changed,
velocities at 10 Hz at most: ``[forward, left, counter-clockwise, upward, about the
forward axis, about the left axis]``, in m/s and rad/s. While STOP stands
``latched`` is true, ``state`` is ``"stopped"``, and ``stop`` tells what is known of it:
``{"by": "Ann", "confirmed": true, "why": "stopped, confirmed by odometry", "id":
"5f0c"}``, with the identity that a reset must name and that is new with each press;
``confirmed`` is null while nobody knows yet and false, with the reason, when nobody
could tell or the robot still moves. ``asker`` is who asks the holder for the lease:
``{"connection": "c6", "name": "Ben", "left": 7.5}`` with the seconds until it is
granted by itself; ``changing`` tells that it goes to somebody else as soon as the robot
stands. ``holder`` and
``epoch`` are null without a lease; ``armed`` says whether a command to move would be
taken now; ``why`` says what binds the speeds ``v`` and ``w`` in force, or, while nobody
has the robot, those that would be if this page took it; ``armable`` and
``reason``, whether it can be taken, and what stands against that or against moving it.
``alarm`` says that the robot moves on a second after zero was sent, ``other_writer``
that another program publishes velocities to it: ``"another program publishes to
/cmd_vel (0.10 m/s, -0.20 rad/s): /teleop"``, with its nodes where they are known. It
comes whether or not somebody drives. ``age`` is the age
of the driver's loop in milliseconds, ``reaction`` the seconds from a finger to the
robot at worst, and ``brake`` the deceleration that is assumed, in m/s². ``stop_time``
is what is known of the base stopping by itself, in seconds: ``"stated"``, or
``"tested"`` on ``stop_date`` (null if it did not stop then). ``test`` tells of the stop
test: ``{"state": "creeping", "text": "..."}``, then ``"waiting"``, ``"done"`` or
``"failed"``. ``way`` is how goals are sent to the robot (null if none can be),
``cancels`` whether they can be called off, ``locates`` whether it can be told where it
is. ``goal`` is the newest one, by the connection ``by``, also when it has ended:
``"sent"``, ``"accepted"``, ``"under way"``, ``"cancelling"``, ``"unknown"`` (what told
of it was lost), ``"reached"``, ``"failed"`` or ``"cancelled"``, with the reason, the
metres and seconds to go, the seconds under way and how often the robot had to free
itself; null is what it does not say. ``hooks`` says which stop hooks failed or are yet
to be said, and why, one sentence each: ``"stop hook /e_stop: no answer within 2 s"``.
``refused`` names the ``op`` (``what``) that was refused, or ``"command"`` for words
that made no sense (``robot`` is then null), or ``"lease"`` when a lease has ended. The
same refusal is said once a second.

What a page may say stands in :mod:`webmap.gate.commands`.
"""

import json

import msgspec

from webmap.gate.limits import Cap, Speed, offered
from webmap.gate.messages import Hello, Refused, RobotGone, RobotReport


def hello_text(hello: Hello) -> str:
    """Return the greeting of a connection."""
    return _text("hello", connection=hello.connection)


def tick_text(tick: int, ack: int) -> str:
    """Return a tick, with what was acknowledged on this connection."""
    return f'{{"op":"tick","tick":{tick},"ack":{ack}}}'


def robot_text(report: RobotReport, *, mine: bool, page: Cap) -> str:
    """Return a report for one page.

    Args:
        report: How it stands with a robot.
        mine: Whether the page has the lease.
        page: What the page asks for at most, which is in force once it has a robot
            that is free now.

    """
    fields = msgspec.to_builtins(report)
    del fields["type"]
    if report.holder is None:
        speed = offered(Speed(report.v, report.w, report.why), page)
        fields |= {"v": speed.v, "w": speed.w, "why": speed.why}
    return _text("robot", mine=mine, **fields)


def gone_text(gone: RobotGone) -> str:
    """Return that a robot is no longer there."""
    return _text("gone", robot=gone.robot)


def refused_text(refused: Refused) -> str:
    """Return that a command was not taken."""
    return _text("refused", robot=refused.robot, what=refused.what, why=refused.why)


def _text(op: str, **fields: object) -> str:
    return json.dumps({"op": op, **fields}, allow_nan=False, separators=(",", ":"))
