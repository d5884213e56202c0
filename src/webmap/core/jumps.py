"""Jumps: poses between which nothing can have driven, and clocks that leap."""

import math

from webmap.core.odometry import PoseReading

FASTEST = 5.0
"""Metres per second; no robot of WebMap's is faster."""

SMALLEST = 0.5
"""Metres; less is no jump but a correction, which all localisation makes."""

LONGEST = 5.0
"""Seconds between two poses after which it may be anywhere."""

BACK = 1.0
"""Seconds by which a stamp may be older than one before; more is a jump of time."""

AHEAD = 10.0
"""Seconds by which stamps may go ahead of the time that passes here; links that
stalled deliver late, and may leave out what is between."""

STANDS = 10.0
"""Seconds for which a jump is said, after the last one."""


EXPECTED = 5.0
"""Seconds after somebody set the pose within which a jump is what they asked for."""


class Jumps:
    """Notices when a robot is somewhere else than it can have driven to."""

    def __init__(self) -> None:
        self.problem: str | None = None
        """What happened, in a sentence, as long as it is worth saying."""
        self._last: PoseReading | None = None
        self._came = -math.inf
        self._jumped = self._asked_for = -math.inf
        self._count = 0

    def expect(self, now: float) -> None:
        """Note that somebody set the pose: the next jumps are what they asked for."""
        self._asked_for = now

    def look(self, reading: PoseReading, now: float, *, timed: bool = True) -> None:
        """Take the next pose, in the frame that all of them are in.

        Args:
            reading: The pose.
            now: When it came, in seconds of any clock that only goes forward.
            timed: Whether a leap of its clock is to be said; not if who told of the
                pose says that already.

        """
        if self.problem is not None and now - self._jumped > STANDS:
            self.problem, self._count = None, 0
        before, self._last = self._last, reading
        passed, self._came = now - self._came, now
        if before is None or before.frame_id != reading.frame_id:
            return
        # By the robot's own clock: after a stall of the link poses come all at once.
        took = reading.stamp - before.stamp
        known = timed and before.stamp and reading.stamp
        if known and not -BACK <= took <= passed + AHEAD:
            self._jumped = now
            self.problem = (
                f"the clock of its poses leapt by {took:+.1f} s: it was set, a "
                f"recording began anew, or two nodes with other clocks tell where it is"
            )
            return
        one, other = before.position, reading.position
        went = math.dist((one.x, one.y), (other.x, other.y))
        if not 0 < took < LONGEST or went <= SMALLEST + FASTEST * took:
            return
        if now - self._asked_for <= EXPECTED:
            return
        self._jumped = now
        self._count += 1
        if self._count == 1:
            self.problem = (
                f"it jumped by {went:.1f} m within {took:.2f} s: it was localised "
                f"anew, or set somewhere else"
            )
        elif self._count == _OFTEN:
            self.problem = (
                f"it jumps again and again, by {went:.1f} m: two nodes seem to tell "
                f"where it is, each something else"
            )

    def forget(self) -> None:
        """Forget where it was: poses to come are from somewhere else."""
        self._last, self.problem, self._count = None, None, 0


_OFTEN = 4
"""Jumps within a short time after which they are no localisation."""
