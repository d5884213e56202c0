"""Reports on robots: sent when they change, but not too often. No I/O."""

from typing import Literal

import msgspec

from webmap.base.geometry import Twist
from webmap.gate.commands import Velocity
from webmap.gate.protocol import (
    MAY_MOVE,
    Activity,
    AskerReport,
    Holder,
    RobotReport,
    RobotSpec,
    StopReport,
    TestReport,
)
from webmap.gate.rules.health import LinkHealth, moves
from webmap.gate.rules.machine import Machine
from webmap.gate.rules.motion import ZERO
from webmap.gate.rules.obedience import MOVES, TURNS
from webmap.gate.rules.speeds import reaction

INTERVAL = 0.1
"""Seconds between two reports that differ only in steadily changing numbers."""

BRAKE = 0.5
"""The deceleration in m/s² that is assumed for a base without a stated one."""

_DIGITS = 3


def report(machine: Machine, spec: RobotSpec, now: float) -> RobotReport:
    """Return what pages and programs are shown of one robot at ``now``."""
    lease = machine.authority.lease
    speed = machine.speeds.own if lease is None else machine.speeds.speed
    age, test = machine.speeds.ages.p95, machine.tests.last
    echoed, measured = machine.observation.echoed, machine.observation.shown(now)
    holder = None
    if lease is not None:
        holder = Holder(lease.connection, lease.name, lease.identity)
    stop_time, reason = machine.speeds.stop_time, _reason(machine, now)
    unavailable = reason if lease is None else machine.authority.why_unavailable(now)
    goals = machine.robots.goals[spec.id]
    return RobotReport(
        robot=spec.id,
        name=spec.name,
        state=machine.state,
        doing=_activity(machine, spec, now),
        latched=machine.latch.acknowledged,
        stop=_stop(machine),
        holder=holder,
        epoch=None if lease is None else lease.epoch,
        asker=_asker(machine, now),
        changing=machine.authority.handover.successor is not None,
        armed=lease is not None and machine.authority.deadman.armed,
        v=speed.v,
        w=speed.w,
        why=speed.why + machine.scan_assist.why,
        link="up" if _link(machine, spec).up else "down",
        sent=_velocity(machine.motion.sent),
        echoed=None if echoed is None else _velocity(echoed),
        measured=None if measured is None else _velocity(measured),
        alarm=_alarm(machine, stop_time, now),
        other_writer=machine.other_writer.description(machine.key.topic),
        age=None if age is None else round(age * 1000, 0),
        reaction=round(reaction(age, stop_time), 3),
        brake=machine.robots.a_max or BRAKE,
        stop_time=stop_time,
        stop_source=_stop_source(machine, stop_time),
        stop_date=None if machine.speeds.tested is None else machine.speeds.tested.date,
        test=None if test is None else TestReport(test.state, test.text),
        armable=unavailable is None,
        reason=reason,
        method=goals.method,
        cancels=goals.can_cancel,
        locates=spec.initial_pose is not None,
        goal=goals.report,
        hooks=machine.robots.hook_failures,
        check=machine.check.report,
    )


def _activity(machine: Machine, spec: RobotSpec, now: float) -> Activity:
    """Return the activity of one robot: the first that applies."""
    state, goals = machine.state, machine.robots.goals[spec.id]
    if state == "stopped":
        confirmed = machine.latch.shown and machine.active_stop.confirmation.confirmed
        return "unconfirmed" if confirmed is False else "stopped"
    if not _link(machine, spec).up:
        return "down"
    if machine.authority.handover.successor is not None:
        return "changing"
    if machine.other_writer.description(machine.key.topic) and state in (
        "free",
        "stopping",
    ):
        return "other"
    if state == "stopping":
        return "stopping"
    if state == "driving":
        return "blocked" if machine.obedience.blocked(now) else "driven"
    measured, held = machine.observation.shown(now), state == "held"
    moving = measured is not None and moves(measured, MOVES, TURNS)
    if goals.navigates(moving=moving):
        return "navigating_held" if held else "navigating"
    if moving:
        braking = machine.obedience.watching(now) or goals.may_still_move(now)
        return "settling" if braking else "moving"
    barred = _reason(machine, now) is not None
    if held:
        return "barred_held" if barred else "held"
    return "barred" if barred else "free"


def _alarm(machine: Machine, stop_time: float | None, now: float) -> str | None:
    """Return the alarm about the motion of the machine, as text, or ``None``."""
    alarm, motion = machine.obedience.alarm(now), machine.motion
    if alarm is not None or machine.control.up or stop_time is not None:
        return alarm
    # What an earlier gate owes may be weeks old.
    ours = motion.moved_at > float("-inf")
    return MAY_MOVE if ours and motion.owes_zero else None


def _reason(machine: Machine, now: float) -> str | None:
    """Return why the machine cannot be driven now, or ``None``."""
    if machine.authority.lease is None:
        return machine.authority.why_unavailable(now)
    return machine.conditions.why_not_driven(now)


def _link(machine: Machine, spec: RobotSpec) -> LinkHealth:
    """Return the link that moves the robot."""
    return machine.control if spec.twist else machine.robots.goals[spec.id].link


def _stop_source(
    machine: Machine, stop_time: float | None
) -> Literal["stated", "tested"] | None:
    if machine.speeds.tested is not None:
        return "tested"
    return None if stop_time is None else "stated"


def _asker(machine: Machine, now: float) -> AskerReport | None:
    asker = machine.authority.handover.asker
    if asker is None:
        return None
    left = round(machine.authority.handover.left(now), 1)
    return AskerReport(asker.id, asker.name, left, asker.identity)


def _stop(machine: Machine) -> StopReport | None:
    press = machine.latch.shown
    if press is None:
        return None
    seen = machine.active_stop.confirmation
    why = seen.why
    if machine.latch.trouble is not None:
        why = f"{why}; a restart would end this STOP: {machine.latch.trouble}"
    return StopReport(press.by, seen.confirmed, why, press.id, press.identity)


def _velocity(twist: Twist) -> Velocity:
    if twist is ZERO:  # the velocity sent to most robots
        return ZERO.numbers
    x, y, turn, z, rx, ry = [round(part, _DIGITS) + 0.0 for part in twist.numbers]
    return (x, y, turn, z, rx, ry)


class Reporter:
    """Decides for one robot which reports are sent."""

    def __init__(self) -> None:
        self._last: RobotReport | None = None
        self._at = float("-inf")

    def is_due(
        self, report: RobotReport, now: float, interval: float = INTERVAL
    ) -> bool | None:
        """Return whether to send ``report`` now; ``None`` means later."""
        last = self._last
        if report == last:
            return False
        if last is not None and now < self._at + interval and _alike(report, last):
            return None
        self._last, self._at = report, now
        return True


def _alike(one: RobotReport, other: RobotReport) -> bool:
    """Return whether two reports differ only in steadily changing numbers."""
    return _gist(one) == _gist(other)


def _gist(report: RobotReport) -> RobotReport:
    """Return ``report`` without the steadily changing numbers."""
    asker, stop, alarm, goal = report.asker, report.stop, report.alarm, report.goal
    if goal is not None:
        goal = msgspec.structs.replace(goal, left=None, time=None, eta=None)
    if asker is not None:
        asker = msgspec.structs.replace(asker, left=0.0)
    if stop is not None:
        stop = msgspec.structs.replace(stop, why="")
    return msgspec.structs.replace(
        report,
        sent=_velocity(Twist()),
        echoed=None,
        measured=None,
        asker=asker,
        stop=stop,
        alarm=None if alarm is None else "",
        other_writer=None if report.other_writer is None else "",
        age=None,
        reaction=0.0,
        goal=goal,
    )
