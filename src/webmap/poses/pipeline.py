"""The poses of one robot: from readings, frames and time to the drawn pose.

This is the pure part: no I/O, no clock, no event loop. :mod:`webmap.core.pose_source`
passes in the robot's data and shows the results.
"""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from webmap.base.geometry import Pose
from webmap.poses.placing import CLOCKS, Placing, PoseReading, ProblemDelay
from webmap.ros.tf import Transform
from webmap.ros.tf.track import Track

if TYPE_CHECKING:
    from webmap.poses.frames import Frames

HISTORY = 10.0
"""Seconds of poses that are kept."""

GAP = 1.0
"""The longest time between two poses for which poses are interpolated, in seconds."""

FASTEST = 5.0
"""The greatest assumed speed of a robot, in metres per second."""

SMALLEST = 0.5
"""The least distance of a jump, in metres; less is a correction, which every
localisation makes."""

LONGEST = 5.0
"""Seconds between two poses after which the robot may be anywhere."""

BACK = 1.0
"""Seconds by which a stamp may be older than the previous one; more is a jump of the
clock."""

AHEAD = 10.0
"""Seconds by which stamps may advance more than the time here; a stalled connection
delivers late, and may drop messages."""

JUMP_SHOWN = 10.0
"""Seconds for which a jump is shown after the last one."""

EXPECTED = 5.0
"""Seconds after an operator or a program set the pose in which a jump is expected."""

OFTEN = 4
"""Jumps within a short time after which they are no localisation."""


_HERE = Pose()


class Problem(NamedTuple):
    """What is wrong now with the frames or the jumps of a robot's poses."""

    kind: str
    """The kind; sentences of one kind may differ, for example in their numbers."""

    text: str
    """A sentence for people."""


class Step(NamedTuple):
    """The result of a reading, of moved frames, or of passed time."""

    pose: PoseReading | None
    """The new pose, on the common map; None if it did not change."""

    problems: Mapping[str, Problem]
    """All current problems, by subject: ``"tf"``, ``"frames"``, ``"jumps"``. The same
    object as before if nothing changed."""

    look_again: float | None
    """When to make a step without a reading, to show a problem that has lasted."""


class PosePipeline:
    """The poses of one robot, now and before, and their problems.

    Readings arrive in any frame. TF transforms them to the robot's own map, and the
    alignment transforms that to the common map, on which all robots are drawn.

    All times except stamps are in seconds of one monotonic clock.
    """

    def __init__(self) -> None:
        self.alignment = Pose()
        """The position and rotation of the robot's own map on the common one."""
        self.placing: Placing | None = None
        """The transform of poses to the robot's own map by TF; None to use poses
        without a transform."""
        self.jumps = Jumps()
        self.newest: PoseReading | None = None
        """The newest pose, in the robot's own map."""
        self._by_topic = False
        self._gap = GAP
        self._track = Track("")
        self._problem_delay = ProblemDelay()
        self._found: tuple[str, str | None, str | None] = ("", None, None)
        self.problems: Mapping[str, Problem] = {}
        """All current problems; see :class:`Step`."""

    def restart(self, period: float | None) -> None:
        """Discard all poses and problems: the next ones come from another source.

        Args:
            period: The least time between two readings of a topic in seconds; None if
                the robot is placed by TF alone.

        """
        self._by_topic = period is not None
        self._gap = max(GAP, 2.5 * (period or 0.0))
        self.newest = None
        self._track.clear()
        self.jumps.forget()
        self._problem_delay = ProblemDelay()
        self._found, self.problems = ("", None, None), {}

    def step(
        self, reading: PoseReading | None, frames: "Frames | None", now: float
    ) -> Step:
        """Process the current data, and return what to show.

        Args:
            reading: The pose of a message; None if frames moved or time passed.
            frames: The frames, if they place the robot.
            now: The time.

        """
        placing = self.placing
        if placing is not None:
            if reading is not None:
                reading = placing.of_reading(reading, now)
            elif not self._by_topic:
                reading = placing.of_base(now)
        if reading is not None:
            # For poses by TF alone, the frames show a jump of the clock themselves.
            self.jumps.look(reading, now, timed=self._by_topic)
            self._keep(reading)
        problems, look_again = self._look_for_problems(frames, now)
        pose = None if reading is None else self.on_map(reading)
        return Step(pose, problems, look_again)

    def on_map(self, reading: PoseReading) -> PoseReading:
        """Transform a pose from the robot's own map to the common one."""
        if self.alignment == _HERE:
            return reading
        return reading.moved(Transform.from_pose(self.alignment), reading.frame_id)

    def at(self, stamp: float, ahead: float = 0.0) -> Transform:
        """Return the robot's pose at a stamp, in its own map.

        Args:
            stamp: In seconds of the robot's clock.
            ahead: Seconds after the newest pose for which the motion is extrapolated.

        Raises:
            NotKnownThen: If the poses around that time are unknown.

        """
        return self._track.at(stamp, self._gap, ahead)

    @property
    def newest_stamp(self) -> float | None:
        """The newest stamp; None if poses have none."""
        return self._track.newest

    def _keep(self, reading: PoseReading) -> None:
        if self.newest is not None and self.newest.frame_id != reading.frame_id:
            self._track.clear()  # the earlier poses are in another frame
        self.newest = reading
        if reading.stamp:
            newest = self._track.newest
            if newest is not None and reading.stamp < newest - BACK:
                self._track.clear()
            self._track.add(reading.transform, reading.stamp, HISTORY)

    def _look_for_problems(
        self, frames: "Frames | None", now: float
    ) -> tuple[Mapping[str, Problem], float | None]:
        """Return all problems, and when to check again if one has not lasted yet."""
        placing = self.placing
        kind, fault = "", None
        if placing is not None and frames is not None:
            fault = frames.faults.of(placing.base_frame, now)
            if placing.kind == CLOCKS or not placing.quiet:
                kind = placing.kind
        earliest = -math.inf if frames is None else frames.complete_from
        due = self._problem_delay.due(kind, now, earliest)
        waits = due is not None and now < due
        found = ("" if waits else kind, fault, self.jumps.problem)
        if found != self._found:
            self.problems = self._problems_of(*found)
            self._found = found
        return self.problems, due if waits else None

    def _problems_of(
        self, kind: str, fault: str | None, jump: str | None
    ) -> Mapping[str, Problem]:
        problems = {}
        if kind and kind == self._found[0]:
            problems["tf"] = self.problems["tf"]  # as it was when it began
        elif kind and self.placing is not None:
            problems["tf"] = Problem(kind, self.placing.problem)
        if fault is not None:
            problems["frames"] = Problem("fault", fault)
        if jump is not None:
            problems["jumps"] = Problem("jump", jump)
        return problems


class Jumps:
    """Detects when a robot is where it cannot have driven to."""

    def __init__(self) -> None:
        self.problem: str | None = None
        """The last jump in a sentence, while it is shown."""
        self._last: PoseReading | None = None
        self._came = -math.inf
        self._jumped = self._expected_since = -math.inf
        self._count = 0

    def expect(self, now: float) -> None:
        """Accept the next jumps: an operator or a program set the pose."""
        self._expected_since = now

    def look(self, reading: PoseReading, now: float, *, timed: bool = True) -> None:
        """Process the next pose, in the frame of all poses.

        Args:
            reading: The pose.
            now: When it arrived, in seconds of any monotonic clock.
            timed: Whether a jump of its clock is a problem; not if the source of the
                pose already shows that.

        """
        if self.problem is not None and now - self._jumped > JUMP_SHOWN:
            self.problem, self._count = None, 0
        before, self._last = self._last, reading
        passed, self._came = now - self._came, now
        if before is None or before.frame_id != reading.frame_id:
            return
        # By the robot's own clock: a stalled connection delivers many poses at once.
        took = reading.stamp - before.stamp
        known = timed and before.stamp and reading.stamp
        if known and not -BACK <= took <= passed + AHEAD:
            self._jumped = now
            self.problem = (
                f"the clock of its poses jumped by {took:+.1f} s: the clock was set, a "
                f"recording started again, or two nodes with different clocks publish "
                f"the pose"
            )
            return
        one, other = before.position, reading.position
        went = math.hypot(one.x - other.x, one.y - other.y)
        if not 0 < took < LONGEST or went <= SMALLEST + FASTEST * took:
            return
        if now - self._expected_since <= EXPECTED:
            return
        self._jumped = now
        self._count += 1
        if self._count == 1:
            self.problem = (
                f"the pose jumped by {went:.1f} m within {took:.2f} s: the robot was "
                f"localised again or moved"
            )
        elif self._count == OFTEN:
            self.problem = (
                f"the pose jumps repeatedly, by {went:.1f} m: two nodes seem to "
                f"publish different poses"
            )

    def forget(self) -> None:
        """Forget the last pose: the next ones come from another source."""
        self._last, self.problem, self._count = None, None, 0
