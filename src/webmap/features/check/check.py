"""The steps of a check before driving, and what it finds; no I/O and no clock."""

from dataclasses import dataclass, field
from typing import Literal

import msgspec

from webmap.gate.protocol import RobotReport

LONGEST = 120.0
"""Seconds after which a check that is not finished has failed."""

ARRIVES = 5.0
"""Seconds within which the gate must report what the page has sent."""

CONFIRMS = 10.0
"""Seconds within which STOP must be confirmed, with its hooks."""

LATE = 0.5
"""Seconds of lag of the connection above which it is too slow."""

OLD = 1.0
"""Seconds above which a pose or a picture is too old."""

STOPS_WITHIN = 0.5
"""The longest command timeout of a base for more than slow speed, in seconds."""

Level = Literal["wrong", "warning", "note", "good"]


class Line(msgspec.Struct, frozen=True):
    """One result: a word, what was found, and what to do."""

    level: Level
    name: str
    text: str
    advice: str = ""


@dataclass(frozen=True, slots=True)
class Facts:
    """What is known of a robot now."""

    report: RobotReport
    lag: float
    """Seconds by which the data of its bridge is late."""
    has_odometry: bool
    age: float | None
    """Seconds since its newest pose."""
    cameras: dict[str, float | None]
    """The age of the newest picture of each camera, in seconds."""


def lines(facts: Facts, stopped_after: float | None) -> list[Line]:
    """Return the results of a check.

    Args:
        facts: What is known of the robot.
        stopped_after: Seconds from STOP to its confirmation; None if it was not
            confirmed with all hooks.

    """
    return [
        _link(facts),
        _odometry(facts),
        _stop(facts, stopped_after),
        _timeout(facts),
        *(_camera(name, age) for name, age in facts.cameras.items()),
    ]


def passes(found: list[Line]) -> bool:
    """Return whether nothing is wrong; a warning is no obstacle."""
    return all(each.level != "wrong" for each in found)


def _link(facts: Facts) -> Line:
    if facts.report.link != "up":
        advice = "Look at the robot's network and at its rosbridge."
        return Line("wrong", "Connection", "no connection for commands", advice)
    text = f"{facts.lag:.2f} s late"
    if facts.lag >= LATE:
        return Line("wrong", "Connection", text, "The network is too slow to drive.")
    return Line("good", "Connection", f"OK, {text}")


def _odometry(facts: Facts) -> Line:
    if not facts.has_odometry:
        advice = "Set the odometry topic: nothing else shows whether the robot stands."
        return Line("wrong", "Odometry", "no topic is known", advice)
    if facts.report.measured is None:
        advice = "Look at the node of the robot that publishes odometry."
        return Line("wrong", "Odometry", "does not arrive", advice)
    if facts.age is None:
        return Line("good", "Odometry", "OK")
    if facts.age > OLD:
        text = f"pose {facts.age:.1f} s old"
        return Line("warning", "Odometry", text, "The map shows where the robot was.")
    return Line("good", "Odometry", f"OK, pose {facts.age:.1f} s old")


def _stop(facts: Facts, stopped_after: float | None) -> Line:
    hooks = facts.report.hooks
    if stopped_after is not None:
        return Line("good", "STOP", f"OK, confirmed after {stopped_after:.1f} s")
    if hooks:
        advice = "Look at the stop hooks of the robot, then check again."
        return Line("wrong", "STOP", "; ".join(hooks), advice)
    why = facts.report.stop.why if facts.report.stop is not None else ""
    advice = "Do not drive this robot until its STOP is confirmed."
    return Line("wrong", "STOP", f"not confirmed: {why}".removesuffix(": "), advice)


def _timeout(facts: Facts) -> Line:
    name, seconds = "Command timeout", facts.report.stop_time
    source, date = facts.report.stop_source, facts.report.stop_date
    how = f"measured on {date}" if source == "tested" else "stated, not measured"
    if seconds is None:
        failed = source == "tested"
        text = f"the base did not stop, {how}" if failed else "unknown"
        advice = "Run the stop test. Until then the robot drives slowly."
        return Line("warning", name, text, advice)
    text = f"{seconds:.2f} s, {how}"
    if seconds > STOPS_WITHIN:
        return Line("warning", name, text, "Above 0.5 s the robot drives slowly.")
    if source != "tested":
        return Line("note", name, text, "Run the stop test to measure it.")
    return Line("good", name, f"OK, {text}")


def _camera(name: str, age: float | None) -> Line:
    if age is None:
        advice = "Look at the camera of the robot, or drive by the map."
        return Line("warning", name, "no picture", advice)
    if age > OLD:
        advice = "Do not drive by this camera."
        return Line("warning", name, f"picture {age:.1f} s old", advice)
    return Line("good", name, f"OK, picture {age:.1f} s old")


Step = Literal["stop", "reset", "report", "over"]
"""What the check waits for: that STOP is confirmed, that the person resets it, that the
gate keeps the check; or nothing more."""

DOING = {
    "stop": "STOP was sent. Waiting until it is confirmed.",
    "reset": "STOP is confirmed. Press Reset to finish the check.",
    "report": "Waiting for the gate.",
}


@dataclass(slots=True)
class Check:
    """One check of one robot, from STOP to the result.

    Args:
        began: When STOP was sent, in seconds of a monotonic clock.
        before: The identity of the STOP that was active before.
        kept: The time of the check that the gate had before.

    """

    began: float
    before: str | None = None
    kept: float | None = None
    step: Step = "stop"
    passed: bool = False
    why: str = ""
    """Why it failed, if a line does not say so."""
    lines: list[Line] = field(default_factory=list)
    _stopped_after: float | None = None
    _reported_at: float = 0.0

    @property
    def is_over(self) -> bool:
        """Whether the check has its result."""
        return self.step == "over"

    @property
    def doing(self) -> str:
        """What the check waits for, as a sentence; empty when it is over."""
        return DOING.get(self.step, "")

    def look(self, facts: Facts, now: float) -> bool:
        """Go on with the check; return whether to report it to the gate now."""
        if self.is_over:
            return False
        if now - self.began > LONGEST:
            self._end(facts, "it was not finished within two minutes")
        elif self.step == "stop":
            self._look_at_stop(facts, now)
        elif self.step == "reset":
            if facts.report.stop is None:
                if passes(self.lines):
                    self.step, self._reported_at = "report", now
                    return True
                self._end(facts)
        else:
            self._look_at_gate(facts, now)
        return False

    def _look_at_stop(self, facts: Facts, now: float) -> None:
        stop, waited = facts.report.stop, now - self.began
        if stop is None or stop.id == self.before:
            if waited > ARRIVES:
                self._end(facts, "STOP did not reach the gate")
        elif stop.confirmed and not facts.report.hooks:
            self._stopped_after, self.step = waited, "reset"
            self._show(facts)
        elif waited > CONFIRMS:
            self._end(facts)

    def _look_at_gate(self, facts: Facts, now: float) -> None:
        check = facts.report.check
        if check is not None and check.at is not None and check.at != self.kept:
            self.step, self.passed = "over", True
        elif now - self._reported_at > ARRIVES:
            self._end(facts, "the gate has not kept the check: reset STOP, check again")

    def _show(self, facts: Facts) -> None:
        self.lines = lines(facts, self._stopped_after)

    def _end(self, facts: Facts, why: str = "") -> None:
        self.step, self.why = "over", why
        if not self.lines:
            self._show(facts)
