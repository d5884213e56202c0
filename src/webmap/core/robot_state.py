"""What a robot is doing, with the texts that every page shows."""

from datetime import datetime, timedelta
from typing import NamedTuple

from webmap.base.geometry import Twist
from webmap.gate.protocol import RobotReport
from webmap.gate.rules.goals import BRAKES, OVER
from webmap.gate.rules.health import moves
from webmap.gate.rules.obedience import MOVES, TURNS
from webmap.poses.silence import PERIODS
from webmap.ros.bridge import Bridge

STATE_TEXTS = {
    "no_bridge": "No connection to the bridge",
    "connecting": "Connecting",
    "gone": "No pose since {since}",
    "watched": "View only",
    "stopped": "STOP active",
    "unconfirmed": "STOP NOT CONFIRMED",
    "down": "No connection for commands",
    "changing": "Handing over",
    "stopping": "Stopping",
    "blocked": "Not moving: blocked?",
    "driven": "{who} is driving",
    "driven_by_you": "You are driving",
    "navigating": "Navigating",
    "navigating_held": "Navigating ({who} has control)",
    "navigating_held_by_you": "Navigating (you have control)",
    "settling": "Still moving",
    "moving": "Moving, not by WebMap",
    "barred": "Cannot be driven",
    "barred_held": "Cannot be driven ({who} has control)",
    "barred_held_by_you": "Cannot be driven (you have control)",
    "other": "Another program is driving",
    "held": "{who} has control",
    "held_by_you": "You have control",
    "free": "Free",
}
"""The text of each state. The page has the same table, generated from this one."""

GONE = 30.0
"""Seconds without a pose, over an open connection, after which a robot is gone."""

FRESH = 1.0
"""Seconds for which the velocity of a pose is used."""

QUIET = ("free", "barred", "down")
"""States of the gate that the display may replace by its own. The page has the same
rule (``doingOf`` of web/motion/report.js)."""


class RobotState(NamedTuple):
    """What a robot is doing."""

    name: str
    """The state: a key of ``STATE_TEXTS``."""

    text: str
    """The text of the state."""

    mine: str
    """The text for the page that has control of the robot."""


class Facts(NamedTuple):
    """The facts that determine the state of a robot."""

    report: RobotReport | None
    """The newest report of the gate; None if the gate does not know the robot."""

    bridge: Bridge | None
    """The bridge of the topic with poses; None if there is no such topic."""

    period: float
    """The least time between two poses of that topic, in seconds."""

    silent_for: float | None
    """Seconds since the newest pose from a source that also sends while the robot is at
    rest; None if there was none."""

    pose_age: float | None
    """Seconds since the newest pose was sent; None if there was none."""

    twist: Twist | None
    """The velocity of that pose, in the axes that the robot moves along."""

    goal_over_for: float | None
    """Seconds since the newest goal ended; None if there is no goal or it has not
    ended."""


def state_of(facts: Facts) -> RobotState:
    """Return what a robot is doing.

    The gate's report decides. The display adds what the gate does not know: the bridge
    and the poses of a robot whose odometry the gate does not receive. Stale data is
    left out: the page detects it by itself, even when it cannot reach this process.
    """
    if facts.report is None:
        return _state(_seen(facts) or "watched", facts)
    name: str = facts.report.doing
    if name in QUIET:
        name = _seen(facts, may_move=name != "down") or name
    return _state(name, facts)


def since_when(silent_for: float | None) -> str:
    """Return when the poses of a robot ended, by the clock of this computer.

    Args:
        silent_for: Seconds since then; None for now.

    """
    return f"{datetime.now() - timedelta(seconds=silent_for or 0.0):%H:%M}"


def _seen(facts: Facts, *, may_move: bool = False) -> str | None:
    """Return the state that the display sees for a robot without an operator."""
    bridge, report = facts.bridge, facts.report
    if bridge is not None and bridge.state != "open":
        return "no_bridge" if bridge.lost else "connecting"
    if _is_gone(facts):
        return "gone"
    if not may_move or report is None or report.measured is not None:
        return None  # the gate receives the same odometry
    if not _moves(facts):
        return None
    if report.goal is not None and report.goal.state not in OVER:
        return "navigating"
    over = facts.goal_over_for
    return "settling" if over is not None and over < BRAKES else "moving"


def _state(name: str, facts: Facts) -> RobotState:
    holder = facts.report.holder if facts.report is not None else None
    who = holder.name or holder.connection if holder is not None else "Another operator"
    text = STATE_TEXTS[name].format(who=who, since=since_when(facts.silent_for))
    return RobotState(name, text, STATE_TEXTS.get(f"{name}_by_you", text))


def _is_gone(facts: Facts) -> bool:
    """Return whether expected poses have been missing for a long time."""
    silent = facts.silent_for
    if silent is None or silent <= GONE:
        return False
    if facts.bridge is None:
        return True
    return silent > PERIODS * facts.period and not facts.bridge.replays


def _moves(facts: Facts) -> bool:
    """Return whether fresh odometry shows a robot in motion."""
    age, twist = facts.pose_age, facts.twist
    if age is None or age > FRESH or twist is None:
        return False
    return moves(twist, MOVES, TURNS)
