"""The pace of a replay: which moment of the recording is due when."""

from dataclasses import dataclass

SECOND = 1_000_000_000
"""Nanoseconds."""

LAST = 2**31 * SECOND
"""The end of what a stamp of ROS 2 can say, in nanoseconds since 1970."""


@dataclass(slots=True)
class Pace:
    """Maps the time of a recording to the time at which it is played; no clock.

    All times are nanoseconds since 1970. At a rate of 1 everything keeps its distance
    from everything else, so a message is as old when it is played as it was when it was
    recorded; at another rate distances are divided by the rate, ages too. Two equal
    stamps stay equal, which frames need.

    Args:
        begin: The moment of the recording that is played first.
        now: When it is played.
        rate: How many seconds of the recording are played in one; above 0.

    """

    begin: int
    now: int
    rate: float = 1.0

    def due(self, recorded: int) -> int:
        """Return when a moment of the recording is played."""
        return self.now + self._scaled(recorded - self.begin, 1 / self.rate)

    def at(self, now: int) -> int:
        """Return the moment of the recording that is played now."""
        return self.begin + self._scaled(now - self.now, self.rate)

    def moved(self, stamp: int) -> int:
        """Return what a recorded stamp says when it is played.

        Zero says that there is no time, and stays; so does a stamp that would leave
        what stamps can say, since it came from a clock that was set to another time.
        """
        moved = self.due(stamp)
        return moved if stamp != 0 and 0 < moved < LAST else stamp

    def put_off(self, by: int) -> None:
        """Play everything later than it was due, by so many nanoseconds."""
        self.now += by

    def _scaled(self, distance: int, factor: float) -> int:
        # A float would round a distance of years to microseconds.
        return distance if factor == 1.0 else round(distance * factor)
