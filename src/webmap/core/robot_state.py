"""What a robot is doing, in the words that every page has for it."""

import time
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, NamedTuple

from webmap.core.silence import PERIODS
from webmap.gate.rules.goals import BRAKES, OVER
from webmap.gate.rules.obedience import MOVES, TURNS
from webmap.gate.rules.standstill import moves

if TYPE_CHECKING:
    from webmap.core.robot import Robot

WORDS = {
    "no_bridge": "No bridge",
    "connecting": "Connecting",
    "gone": "Gone since {since}",
    "watched": "Watched only",
    "stopped": "Stopped",
    "unconfirmed": "STOP NOT CONFIRMED",
    "down": "No way to drive it",
    "changing": "Handing over",
    "stopping": "Stopping",
    "blocked": "Not moving: blocked?",
    "driven": "{who} drives",
    "driven_by_you": "You drive",
    "navigating": "Navigating",
    "navigating_held": "Navigating, {who} holds it",
    "navigating_held_by_you": "Navigating, you hold it",
    "settling": "Still moving",
    "moving": "Moving, not by WebMap",
    "barred": "Cannot be driven",
    "barred_held": "Cannot be driven, {who} holds it",
    "barred_held_by_you": "Cannot be driven, you hold it",
    "other": "Another program drives it",
    "held": "{who} holds it",
    "held_by_you": "You hold it",
    "free": "Free",
}
"""The words of each state. The page has the same table, made from this one."""

GONE = 30.0
"""Seconds without a pose, over a link that is open, after which a robot is gone."""

FRESH = 1.0
"""Seconds for which the velocity of a pose counts."""

QUIET = ("free", "barred", "down")
"""States of the gate that the display may replace by what it knows. The page has the
same rule (``doingOf`` of web/motion/report.js)."""


class RobotState(NamedTuple):
    """What a robot is doing."""

    name: str
    """Which state it is: a key of ``WORDS``."""

    text: str
    """The state in words."""

    mine: str
    """The words for the page that holds the robot."""


def state_of(robot: "Robot") -> RobotState:
    """Return what a robot is doing.

    The gate decides what it knows. The display adds what only the display knows: the
    bridge and the poses of a robot that the gate does not listen to. Whether data is
    old is left out: the page sees that by itself, also when it cannot reach this
    process.
    """
    report = robot.report
    if report is None:
        return _state(_seen(robot) or "watched", robot)
    name: str = report.doing
    if name in QUIET:
        name = _seen(robot, may_move=name != "down") or name
    return _state(name, robot)


def since_when(robot: "Robot") -> str:
    """Return when the newest pose came, by the clock of this computer."""
    silent = timedelta(seconds=robot.silent_for or 0.0)
    return f"{datetime.now() - silent:%H:%M}"


def _seen(robot: "Robot", *, may_move: bool = False) -> str | None:
    """Return what the display knows of a robot that nobody drives."""
    bridge = robot.feed.bridge if robot.feed is not None else None
    if bridge is not None and bridge.state != "open":
        return "no_bridge" if bridge.lost else "connecting"
    if _is_gone(robot):
        return "gone"
    report = robot.report
    if not may_move or report is None or report.measured is not None:
        return None  # the gate looks at the same odometry
    if not _moves(robot):
        return None
    if report.goal is not None and report.goal.state not in OVER:
        return "navigating"
    ended = robot.goal_ended_at
    brakes = ended is not None and time.monotonic() - ended < BRAKES
    return "settling" if brakes else "moving"


def _state(name: str, robot: "Robot") -> RobotState:
    holder = robot.report.holder if robot.report is not None else None
    who = holder.name or holder.connection if holder is not None else "Somebody"
    text = WORDS[name].format(who=who, since=since_when(robot))
    return RobotState(name, text, WORDS.get(f"{name}_by_you", text))


def _is_gone(robot: "Robot") -> bool:
    """Return whether poses that should come have not come for long."""
    silent, feed = robot.silent_for, robot.feed
    if silent is None or silent <= GONE:
        return False
    if feed is None:
        return True
    return silent > PERIODS * feed.throttle / 1000 and not feed.bridge.replays


def _moves(robot: "Robot") -> bool:
    """Return whether fresh odometry shows a robot in motion."""
    if robot.pose_age is None or robot.pose_age > FRESH:
        return False
    twist = robot.motion.axes.seen(robot.measured_twist)
    return twist is not None and moves(twist, MOVES, TURNS)
