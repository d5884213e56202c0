"""What the reports of the gates mean for the shift log: entries from their changes.

This is the one place that observes control, driving, STOP, limits, goals and poses, of
all robots and of all gates.
"""

import math
import threading
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from webmap.core.shift_log import Person, RobotName, ShiftLog
from webmap.gate.protocol import (
    GateDown,
    GateUp,
    Holder,
    LeaseEnded,
    PageAsked,
    Report,
    RobotGone,
    RobotReport,
    SentPose,
)
from webmap.gate.rules.goals import OVER

LONGEST_DRIVE = 600.0
"""Seconds after which a drive that goes on gets a summary."""

LONGEST_STEP = 10.0
"""Seconds for which the velocity of a report counts at most; a report comes with each
change."""

LIMITS_EVERY = 10.0
"""Seconds between two entries about the limits of one robot, which may follow the
quality of a network."""

AGE_STEP = 5
"""The ages of commands are counted in steps of so many milliseconds."""


class Draft(NamedTuple):
    """An entry without its time."""

    kind: str
    text: str
    robot: RobotName | None
    person: Person | None = None
    facts: dict[str, Any] = {}  # noqa: RUF012 - never changed


@dataclass(slots=True)
class Drive:
    """The driving of one person, until control ends."""

    person: Person
    began: float
    at: float
    """The time of the newest report."""
    speed: float = 0.0
    """The speed in the newest report, in m/s."""
    distance: float = 0.0
    top: float = 0.0
    driving: bool = False
    """Whether the person drove at the newest report: control may also rest."""
    seconds: float = 0.0
    ages: Counter[int] = field(default_factory=Counter)

    def observe(self, report: RobotReport, now: float) -> None:
        """Add the time since the last report, and the velocity of this one."""
        step = min(now - self.at, LONGEST_STEP)
        self.distance += self.speed * step
        self.seconds += step if self.driving else 0.0
        velocity = report.measured or report.sent
        self.at, self.speed = now, math.hypot(velocity[0], velocity[1], velocity[3])
        self.top = max(self.top, self.speed)
        self.driving = report.state == "driving"
        if self.driving and report.age is not None:
            self.ages[round(report.age / AGE_STEP) * AGE_STEP] += 1

    def summary(self, robot: RobotName) -> Draft:
        """Return the entry about the drive."""
        text = (
            f"drove {self.distance:.1f} m in {self.seconds:.0f} s, at most "
            f"{self.top:.2f} m/s"
        )
        facts = {
            "distance_m": self.distance,
            "seconds": self.seconds,
            "top_m_s": self.top,
            "age_p50_ms": quantile(self.ages, 0.50),
            "age_p99_ms": quantile(self.ages, 0.99),
        }
        return Draft("drive", text, robot, self.person, facts)


def quantile(counts: Counter[int], share: float) -> int | None:
    """Return the value below which a share of the counted values is."""
    left = share * counts.total()
    for value in sorted(counts):
        left -= counts[value]
        if left <= 0:
            return value
    return None


@dataclass(slots=True)
class RobotWatch:
    """What is remembered of one robot."""

    old: RobotReport | None = None
    drive: Drive | None = None
    lease_why: str = ""
    """Why the last lease ended, until its end is noted."""
    reset_by: Person | None = None
    """Who asked for the reset of the STOP, until it is noted."""
    cancelled_by: Person | None = None
    limits: tuple[float, float] = (0.0, 0.0)
    limits_at: float = -math.inf

    def entries(self, new: RobotReport, now: float) -> Iterator[Draft]:
        """Yield the entries about what has changed.

        Args:
            new: The newest report.
            now: Seconds, monotonic.

        """
        old, self.old = self.old, new
        robot = RobotName(new.robot, new.name)
        yield from self._driving(old, new, robot, now)
        yield from self._control(old, new, robot)
        yield from self._stop(old, new, robot)
        yield from self._limits(new, robot, now)
        yield from self._goal(old, new, robot)

    def _driving(
        self, old: RobotReport | None, new: RobotReport, robot: RobotName, now: float
    ) -> Iterator[Draft]:
        if self.drive is not None:
            self.drive.observe(new, now)
            same = old is not None and _is_same(old.holder, new.holder)
            if not same or now - self.drive.began > LONGEST_DRIVE:
                yield from self.end_drive()
        if new.state == "driving" and self.drive is None and new.holder is not None:
            self.drive = Drive(_person(new.holder), now, now)
            self.drive.observe(new, now)
            if old is None or old.state != "driving":
                yield Draft("drive", "began to drive", robot, self.drive.person)

    def end_drive(self) -> Iterator[Draft]:
        """Yield the summary of the drive, if there is one."""
        drive, self.drive = self.drive, None
        if drive is not None and self.old is not None:
            yield drive.summary(RobotName(self.old.robot, self.old.name))

    def pose(self, sent: SentPose) -> Iterator[Draft]:
        """Yield the entry about an initial pose that was sent."""
        if self.old is None:
            return
        holder = self.old.holder
        by = holder if holder and holder.connection == sent.by else None
        facts = {"x": sent.x, "y": sent.y, "yaw": sent.yaw}
        text = f"set the pose to {sent.x:.2f}, {sent.y:.2f}"
        robot = RobotName(self.old.robot, self.old.name)
        yield Draft("pose", text, robot, _person(by) if by else None, facts)

    def _control(
        self, old: RobotReport | None, new: RobotReport, robot: RobotName
    ) -> Iterator[Draft]:
        before = None if old is None else old.holder
        if before is not None and not _is_same(before, new.holder):
            why, self.lease_why = self.lease_why, ""
            text = f"lost control: {why}" if why else "released control"
            yield Draft("control", text, robot, _person(before))
        if new.holder is not None and not _is_same(before, new.holder):
            self.lease_why = ""
            facts = {"epoch": new.epoch, "v": new.v, "w": new.w}
            yield Draft("control", "took control", robot, _person(new.holder), facts)
        asker, asked = new.asker, None if old is None else old.asker
        if asker is not None and (
            asked is None or asked.connection != asker.connection
        ):
            who = Person.of(asker.name, asker.identity)
            of = "" if new.holder is None else f" from {new.holder.name}"
            yield Draft("request", f"requested control{of}", robot, who)

    def _stop(
        self, old: RobotReport | None, new: RobotReport, robot: RobotName
    ) -> Iterator[Draft]:
        before, stop = None if old is None else old.stop, new.stop
        if stop is None:
            if before is not None:
                by, self.reset_by = self.reset_by, None
                yield Draft("reset", "reset STOP", robot, by, {"stop": before.id})
            return
        by = Person.of(stop.by, stop.identity)
        facts: dict[str, Any] = {"stop": stop.id}
        if before is None or before.id != stop.id:
            text = "STOP is active from before" if old is None else "pressed STOP"
            if old is not None and old.state == "driving" and old.holder is not None:
                facts["driver"] = old.holder.name
            yield Draft("stop", text, robot, by, facts)
        elif before.confirmed == stop.confirmed:
            return
        if stop.confirmed is not None:
            text = stop.why if stop.confirmed else f"not confirmed: {stop.why}"
            facts = {"stop": stop.id, "confirmed": stop.confirmed}
            yield Draft("stop", text, robot, None, facts)

    def _limits(
        self, new: RobotReport, robot: RobotName, now: float
    ) -> Iterator[Draft]:
        limits = round(new.v, 2), round(new.w, 2)
        recent = now - self.limits_at < LIMITS_EVERY
        if new.holder is None or limits == self.limits or recent:
            return
        self.limits, self.limits_at = limits, now
        why = f": {', '.join(new.why)}" if new.why else ""
        text = f"limits {new.v:.2g} m/s and {new.w:.2g} rad/s{why}"
        facts = {"v": new.v, "w": new.w}
        yield Draft("limits", text, robot, _person(new.holder), facts)

    def _goal(
        self, old: RobotReport | None, new: RobotReport, robot: RobotName
    ) -> Iterator[Draft]:
        before, goal = None if old is None else old.goal, new.goal
        if goal is None:
            return
        facts: dict[str, Any] = {"goal": goal.id}
        if before is None or before.id != goal.id:
            if old is None and goal.state in OVER:
                return
            holders = (new.holder, None if old is None else old.holder)
            by = next((h for h in holders if h and h.connection == goal.by), None)
            self.cancelled_by = None
            facts |= {"x": goal.x, "y": goal.y, "yaw": goal.yaw}
            text = f"goal at {goal.x:.2f}, {goal.y:.2f}"
            yield Draft("goal", text, robot, _person(by) if by else None, facts)
        elif before.state == goal.state:
            return
        if goal.state in OVER or goal.state == "unknown":
            by_whom, self.cancelled_by = self.cancelled_by, None
            why = f": {goal.why}" if goal.why else ""
            cancelled = by_whom if goal.state == "cancelled" else None
            yield Draft("goal", f"goal {goal.state}{why}", robot, cancelled, facts)


def _person(holder: Holder) -> Person:
    return Person.of(holder.name, holder.identity)


def _is_same(one: Holder | None, other: Holder | None) -> bool:
    if one is None or other is None:
        return one is other
    return one.connection == other.connection


class ShiftWatch:
    """Notes what the reports of all gates show; called by several threads.

    Args:
        log: The log.

    """

    def __init__(self, log: ShiftLog) -> None:
        self._log = log
        self._robots: dict[str, RobotWatch] = {}
        self._gate_is_down = False
        self._lock = threading.Lock()

    def on_report(self, report: Report) -> None:
        """Take a report of a gate."""
        with self._lock:
            self._note(self._entries(report))

    def end(self) -> None:
        """Note the drives that have not ended: WebMap ends, and then the gate."""
        with self._lock:
            self._note(self._end_drives())
            self._gate_is_down = True

    def _note(self, drafts: Iterator[Draft]) -> None:
        for kind, text, robot, person, facts in drafts:
            self._log.note(kind, text, robot=robot, person=person, **facts)

    def _entries(self, report: Report) -> Iterator[Draft]:
        match report:
            case RobotReport():
                watch = self._robots.setdefault(report.robot, RobotWatch())
                yield from watch.entries(report, time.monotonic())
            case RobotGone(robot):
                yield from self._watch(robot).end_drive()
                self._robots.pop(robot, None)
            case LeaseEnded(robot, why):
                self._watch(robot).lease_why = why
            case PageAsked(robot, op, name, identity):
                by = Person.of(name, identity) if name else None
                if op == "reset":
                    self._watch(robot).reset_by = by
                else:
                    self._watch(robot).cancelled_by = by
            case SentPose():
                yield from self._watch(report.robot).pose(report)
            case GateDown(why) if not self._gate_is_down:
                self._gate_is_down = True
                yield from self._end_drives()
                yield Draft("link", f"the gate ended: {why}", None)
            case GateUp() if self._gate_is_down:
                self._gate_is_down = False
                yield Draft("link", "the gate runs again", None)

    def _end_drives(self) -> Iterator[Draft]:
        for watch in self._robots.values():
            yield from watch.end_drive()

    def _watch(self, robot: str) -> RobotWatch:
        return self._robots.get(robot) or RobotWatch()
