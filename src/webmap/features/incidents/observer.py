"""What is recorded of the robots: poses, scans, velocities, and events in words."""

import math
from collections.abc import Iterator
from typing import Any

from webmap.bags.ring import (
    EventRecord,
    Frame,
    Kind,
    Place,
    PoseRecord,
    Record,
    ScanRecord,
    VelocityRecord,
)
from webmap.base.geometry import Pose
from webmap.core.problems import cut
from webmap.core.robot import Robot
from webmap.gate.protocol import RobotReport
from webmap.gate.rules.goals import OVER
from webmap.ros.messages import LaserScanMsg
from webmap.ros.tf import Transform, TransformError

POSES = 0.2
"""Seconds between two poses of a robot that moves."""

RARELY = 0.5
"""Seconds between two scans, and between two poses of a robot that stands still: more
than a second would be shown as stale when it is played."""

MOST_RAYS = 240
"""The greatest number of rays of a recorded scan."""


def events_between(
    before: RobotReport | None, now: RobotReport
) -> Iterator[tuple[Kind, str, str]]:
    """Yield what happened between two reports of a robot.

    Each is the kind and the text of an event, and why the recording is kept because of
    it, or "". The first report says what is the case, and not what happened.
    """
    first = before is None
    stop, old = now.stop, before.stop if before else None
    if stop is not None and (old is None or old.id != stop.id):
        if first:
            yield "note", f"STOP is active, by {stop.by}", ""
        else:
            yield "stop", f"STOP by {stop.by}", "stop"
    if old is not None and stop is None:
        yield "note", "STOP was reset", ""
    if stop is not None and stop.confirmed and not (old and old.confirmed):
        yield "note", f"STOP confirmed: {stop.why}", ""
    if now.doing == "unconfirmed" and before and before.doing != "unconfirmed":
        why = stop.why if stop is not None else ""
        yield "alarm", f"STOP not confirmed: {why}", "stop not confirmed"
    if now.alarm is not None and before and before.alarm is None:
        yield "alarm", f"Not obeying: {now.alarm}", "not obeying"
    yield from _control(before, now)
    yield from _goal(before, now)


def _control(
    before: RobotReport | None, now: RobotReport
) -> Iterator[tuple[Kind, str, str]]:
    held = before.holder.name if before and before.holder else ""
    holds = now.holder.name if now.holder else ""
    if holds != held:
        yield "note", f"Controlled by {holds}" if holds else "Control released", ""
    link = before.link if before else "down"
    if now.link != link:
        up = "open" if now.link == "up" else "lost"
        yield "note", f"The connection for commands is {up}", ""
    if now.other_writer and not (before and before.other_writer):
        yield "note", f"Another program sends velocities: {now.other_writer}", ""


def _goal(
    before: RobotReport | None, now: RobotReport
) -> Iterator[tuple[Kind, str, str]]:
    goal, old = now.goal, before.goal if before else None
    if goal is None:
        return
    known = old is not None and old.id == goal.id
    if not known and goal.state not in OVER:
        yield "goal", f"Goal at {goal.x:.2f}, {goal.y:.2f} m", ""
    ended = goal.state in OVER and not (known and old and old.state in OVER)
    if ended and before is not None:
        why = f": {goal.why}" if goal.why else ""
        yield "result", f"Goal {goal.state}{why}", ""


class RobotObserver:
    """Makes the records of one robot; remembers what was recorded last."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.records: list[Record] = []
        """The records that were not taken yet."""
        self._pose: object = None
        self._pose_at = -math.inf
        self._stamp: float | None = None
        self._scan: object = None
        self._scan_at = -math.inf
        self._report: RobotReport | None = None
        self._velocities: object = None

    def take(self) -> Frame:
        """Return the records until now, and forget them."""
        records, self.records = self.records, []
        return Frame(self.robot.id, self.robot.name, records)

    def note(self, time: int, kind: Kind, text: str) -> None:
        """Record an event at ``time``, in nanoseconds since 1970."""
        self.records.append(EventRecord(time, kind, cut(text)))

    def look(self, now: float, time: int) -> list[str]:
        """Record what is new of the robot.

        Args:
            now: Seconds of ``time.monotonic()``.
            time: Nanoseconds since 1970.

        Returns:
            Why the recording is to be kept; empty if nothing has happened.

        """
        reasons = []
        report = self.robot.report
        if report is not None and report is not self._report:
            for kind, text, why in events_between(self._report, report):
                self.note(time, kind, text)
                if why:
                    reasons.append(why)
            self._report = report
            velocities = (report.sent, report.echoed, report.measured)
            if velocities != self._velocities:
                self._velocities = velocities
                self.records.append(VelocityRecord(time, *velocities))
        if now - self._pose_at >= POSES:
            self._look_at_pose(now, time)
        if now - self._scan_at >= RARELY:
            self._look_at_scan(now, time)
        return reasons

    def _look_at_pose(self, now: float, time: int) -> None:
        robot, stamp = self.robot, self.robot.pose_stamp
        if not robot.valid or stamp is None or stamp == self._stamp:
            return
        pose = (robot.position, robot.orientation, robot.measured_twist)
        if pose == self._pose and now - self._pose_at < RARELY:
            return
        self._pose, self._pose_at, self._stamp = pose, now, stamp
        p, q, twist = pose
        self.records.append(
            PoseRecord(
                time,
                time - round((now - stamp) * 1e9),
                (p.x, p.y, p.z, q.x, q.y, q.z, q.w),
                None if twist is None else twist.numbers,
            )
        )

    def _look_at_scan(self, now: float, time: int) -> None:
        for module in self.robot.modules:
            newest = getattr(module, "newest_scan", None)
            if newest is None:
                continue
            if newest is not self._scan:
                self._scan, self._scan_at = newest, now
                age = now - newest[1] + module.bridge.lag
                stamp = time - round(age * 1e9)
                self.records.append(scan_record(module, newest[0], time, stamp))
            return  # of several scanners the first one


def scan_record(scanner: Any, scan: LaserScanMsg, time: int, stamp: int) -> ScanRecord:
    """Return the record of a scan, with every n-th of its rays if there are many."""
    ranges = scan.ranges
    step = max(1, -(-len(ranges) // MOST_RAYS))
    return ScanRecord(
        time,
        stamp,
        scan.angle_min,
        scan.angle_increment * step,
        scan.range_min,
        scan.range_max,
        ranges[::step].astype("<f4").tobytes(),
        _mount_of(scanner, scan.frame_id),
    )


def _mount_of(scanner: Any, frame_id: str) -> Place:
    """Return where a sensor is on its robot, by its options or by the frames."""
    pose = Pose(scanner.x, scanner.y, math.radians(scanner.angle))
    mount = Transform.from_pose(pose)
    placing = scanner.robot.pose_source.pipeline.placing
    if placing is not None and frame_id and pose == Pose():
        source = placing.name(frame_id)
        try:
            found = placing.buffer.find(placing.base_frame, source, 0.0)
            mount = found.transform
        except TransformError:
            pass  # the frames are not known yet
    t, q = mount.translation, mount.rotation
    return (t.x, t.y, t.z, q.x, q.y, q.z, q.w)
