"""Reports on machines: what changed is said, but not more often than anybody looks."""

from webmap.gate.base import Base
from webmap.gate.messages import Holder, RobotReport, RobotSpec, StopReport, Velocity
from webmap.geometry import Twist

INTERVAL = 0.1
"""The shortest time between two reports that differ in velocities only."""

_DIGITS = 3


def report(base: Base, spec: RobotSpec, now: float) -> RobotReport:
    """Return how it stands with one robot at ``now``."""
    lease, speed = base.lease, base.speed
    unarmable = base.unarmable(now)
    holder = None if lease is None else Holder(lease.connection, lease.name)
    link = base.control if spec.twist_topic else base.goals[spec.id].link
    return RobotReport(
        robot=spec.id,
        name=spec.name,
        state=base.state,
        latched=base.latch.acknowledged,
        stop=_stop(base),
        holder=holder,
        epoch=None if lease is None else lease.epoch,
        armed=lease is not None and base.deadman.armed,
        v=speed.v,
        w=speed.w,
        why=speed.why,
        link="up" if link.up else "down",
        sent=_velocity(base.motion.sent) or (0.0, 0.0, 0.0),
        echoed=_velocity(base.sight.echoed),
        measured=_velocity(base.sight.measured),
        armable=unarmable is None,
        reason=unarmable if lease is None else base.doubt(now),
    )


def _stop(base: Base) -> StopReport | None:
    if not base.latch.acknowledged:
        return None
    seen = base.confirmation
    why = seen.why
    if base.latch.trouble is not None:
        why = f"{why}; a restart would forget this STOP: {base.latch.trouble}"
    return StopReport(base.latch.by or "", seen.confirmed, why)


def _velocity(twist: Twist | None) -> Velocity | None:
    if twist is None:
        return None
    return (
        round(twist.vx, _DIGITS) + 0.0,
        round(twist.vy, _DIGITS) + 0.0,
        round(twist.wz, _DIGITS) + 0.0,
    )


class Reporter:
    """Decides for one robot which report is worth saying."""

    def __init__(self) -> None:
        self._last: RobotReport | None = None
        self._at = float("-inf")

    def worth_saying(self, report: RobotReport, now: float) -> bool | None:
        """Return whether to say ``report`` now; ``None`` means later."""
        last = self._last
        if report == last:
            return False
        if last is not None and now < self._at + INTERVAL and _alike(report, last):
            return None
        self._last, self._at = report, now
        return True


def _alike(one: RobotReport, other: RobotReport) -> bool:
    """Return whether two reports differ in velocities only."""
    return all(
        getattr(one, field) == getattr(other, field)
        for field in RobotReport.__struct_fields__
        if field not in ("sent", "echoed", "measured")
    )
