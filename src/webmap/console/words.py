"""What is said of a robot: a word, a shape and a tone that always go together."""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from webmap.geometry import Twist

if TYPE_CHECKING:
    from webmap import Bridge, Robot

UNKNOWN = "\N{EN DASH}"
"""What stands where a number would."""

LOW, EMPTY = 0.2, 0.1
"""Charges below which a battery is low, and as good as empty."""


MOVES, TURNS = 0.05, 0.1
"""Speeds in m/s and rad/s from which on a robot moves: the driving panel's too."""

GOING = ("sent", "accepted", "under way", "cancelling", "unknown")
"""States of a goal that may still move the robot."""


@dataclass(frozen=True, slots=True)
class Words:
    """How a state reads and looks."""

    text: str
    shape: str
    """A symbol of console.html."""
    tone: str = ""
    """``active``, ``warn``, ``bad`` or nothing."""
    mine: str = ""
    """The text where it is the reader who drives, if that differs."""


def describe(robot: "Robot") -> Words:
    """Return what there is to say of a robot, the most pressing first.

    That its data is old is not said here: the page sees that by itself, also when it
    cannot reach this process.
    """
    bridge = robot.feed.bridge if robot.feed is not None else None
    if bridge is not None and bridge.state != "open":
        if is_lost(bridge):
            return Words("No bridge", "state-down", "bad")
        return Words("Connecting", "state-waiting")
    report = robot.report
    if report is None:
        return Words("Watched only", "state-watched")
    words = _of_report(robot)
    if report.other_writer is None or report.link == "down":
        return words
    if report.state in ("free", "stopping"):
        return Words("Another program drives it", "state-driving", "warn")
    driven = report.state == "driving"
    also = ", another program too" if driven else ", another publishes"
    mine = words.mine and words.mine + also
    return replace(words, text=words.text + also, mine=mine, tone="bad")


def _of_report(robot: "Robot") -> Words:
    report = robot.report
    assert report is not None
    who = report.holder.name if report.holder is not None else "Somebody"
    if report.state == "stopped":
        return Words("Stopped", "state-stopped", "bad")
    if report.link == "down":
        return Words("No way to drive it", "state-down", "bad")
    if report.state == "stopping":
        return Words("Stopping", "state-stopping", "warn")
    if report.state == "driving":
        return Words(f"{who} drives", "state-driving", "active", "You drive")
    if report.state == "held":
        return Words(f"{who} holds it", "state-held", "active", "You hold it")
    moves = _moves(report.measured)
    if _goes(robot, moves):
        return Words("On its way", "goal-way", "active")
    if moves:
        return Words("Still moving", "state-stopping", "warn")
    return Words("Free", "state-free")


def _goes(robot: "Robot", moves: bool) -> bool:
    """Return whether a goal moves a robot; of a plain topic only its motion tells."""
    report = robot.report
    if report is None or report.goal is None or report.goal.state not in GOING:
        return False
    return report.goal.way != "topic" or (report.cancels and moves)


def _moves(measured: tuple[float, ...] | None) -> bool:
    """Return whether odometry that is fresh shows a robot in motion."""
    if measured is None:
        return False
    twist = Twist(*measured)
    return twist.speed >= MOVES or twist.turn >= TURNS


def is_lost(bridge: "Bridge") -> bool:
    """Return whether a bridge is away, and not merely not reached yet."""
    return bridge.state == "closed" or bridge.trouble is not None


def battery_tone(charge: float) -> str:
    """Return how a charge between 0 and 1 is to be shown."""
    if charge < EMPTY:
        return "bad"
    return "warn" if charge < LOW else ""


def number(value: float, digits: int = 2) -> str:
    """Return a number as people read it: a real minus sign, and never minus zero."""
    if not math.isfinite(value):
        return UNKNOWN
    text = f"{value:.{digits}f}"
    if float(text) == 0:
        text = text.removeprefix("-")
    return text.replace("-", "\N{MINUS SIGN}")


def heading(yaw: float) -> str:
    """Return a yaw in radians as whole degrees in 0 to 359."""
    return str(round(math.degrees(yaw)) % 360)


def sentence(text: str) -> str:
    """Return words of the gate as a sentence."""
    return f"{text[:1].upper()}{text[1:].rstrip('.')}." if text else ""
