"""The known transforms of one frame in its parent, over time."""

import math
from bisect import bisect_left, bisect_right

from webmap.ros.tf.transform import NotKnownThen, Transform, between

MOST = 4096
"""Most transforms that are kept of one frame."""

SPAN = 0.1
"""Seconds of motion that are used for extrapolation."""

EVEN = 0.5
"""Seconds between two transforms above which a motion is not extrapolated."""

FASTEST = 5.0
"""Metres per second; a faster change is a correction, not a motion."""

FASTEST_TURN = 10.0
"""Radians per second; a faster change is a correction, not a motion."""


class Track:
    """The transforms of one frame in its parent.

    Args:
        parent: The parent's name.
        frame: The frame's own name.
        static: Whether the only transform holds for all times.

    """

    def __init__(self, parent: str, frame: str = "", *, static: bool = False) -> None:
        self.parent = parent
        self.frame = frame
        self.name = f"{parent!r} -> {frame!r}"
        """The name in error messages."""
        self.static = static
        self._stamps: list[float] = []
        self._transforms: list[Transform] = []

    @property
    def last(self) -> float:
        """The newest stamp, also of a static transform; -inf if there is none."""
        return self._stamps[-1] if self._stamps else -math.inf

    @property
    def newest(self) -> float | None:
        """The newest stamp; None if there is none, or the transform is static."""
        return self._stamps[-1] if self._stamps and not self.static else None

    def clear(self) -> None:
        """Forget all transforms."""
        self._stamps.clear()
        self._transforms.clear()

    def add(self, transform: Transform, stamp: float, history: float) -> None:
        """Add a transform; transforms may come in any order.

        Args:
            transform: The frame in its parent.
            stamp: The time of the transform, in seconds.
            history: Time before the newest transform that is kept, in seconds.

        """
        if self.static:
            self._stamps[:], self._transforms[:] = [stamp], [transform]
            return
        stamps, transforms = self._stamps, self._transforms
        if not stamps or stamp > stamps[-1]:  # nearly always
            stamps.append(stamp)
            transforms.append(transform)
        else:
            place = bisect_left(stamps, stamp)
            if stamps[place] == stamp:
                transforms[place] = transform
            else:
                stamps.insert(place, stamp)
                transforms.insert(place, transform)
        if stamps[0] < stamps[-1] - history or len(stamps) > MOST:
            old = bisect_left(stamps, stamps[-1] - history)
            old = max(old, len(stamps) - MOST)
            del stamps[:old], transforms[:old]

    def at(self, time: float, gap: float, ahead: float = 0.0) -> Transform:
        """Return the transform at a time.

        Args:
            time: The time, in seconds.
            gap: The longest time between two transforms for interpolation, in seconds.
            ahead: Seconds after the newest transform for which the motion is
                extrapolated.

        Raises:
            NotKnownThen: If the transform is not known at that time; the sentence names
                no frames.

        """
        if not self._stamps:
            raise NotKnownThen("nothing was received since time jumped")
        if self.static:
            return self._transforms[0]
        place = bisect_left(self._stamps, time)
        if place == len(self._stamps):
            if time <= self._stamps[-1] + ahead:
                return self._going_on(time)
            raise NotKnownThen(
                f"the newest stamp is {self._stamps[-1]:.3f} s, "
                f"{time - self._stamps[-1]:.3f} s before the requested {time:.3f} s"
            )
        if self._stamps[place] == time:
            return self._transforms[place]
        if place == 0:
            raise NotKnownThen(
                f"the oldest stamp is {self._stamps[0]:.3f} s, "
                f"{self._stamps[0] - time:.3f} s after the requested {time:.3f} s"
            )
        before, after = self._stamps[place - 1], self._stamps[place]
        if after - before > gap:
            raise NotKnownThen(
                f"there is a gap of {after - before:.3f} s from {before:.3f} s on, and "
                f"the requested {time:.3f} s is in it"
            )
        share = (time - before) / (after - before)
        return between(self._transforms[place - 1], self._transforms[place], share)

    def _going_on(self, time: float) -> Transform:
        """Return the extrapolated transform; the newest one after a leap."""
        newest, last = self._transforms[-1], self._stamps[-1]
        # Stamps that are close together give an inexact speed.
        place = bisect_right(self._stamps, last - SPAN) - 1
        took = last - self._stamps[max(place, 0)]
        before = self._transforms[max(place, 0)]
        if not SPAN / 2 <= took <= EVEN or leapt(before, newest, took):
            return newest
        return between(before, newest, 1.0 + (time - last) / took)


def leapt(one: Transform, other: Transform, took: float) -> bool:
    """Return whether a change is too fast for a motion.

    Args:
        one: The transform before.
        other: The transform after.
        took: The time between them, in seconds.

    """
    p, q = one.rotation, other.rotation
    cosine = abs(p.x * q.x + p.y * q.y + p.z * q.z + p.w * q.w)
    turned = 2.0 * math.acos(min(cosine, 1.0))
    a, b = one.translation, other.translation
    went = math.dist((a.x, a.y, a.z), (b.x, b.y, b.z))
    return went > FASTEST * took or turned > FASTEST_TURN * took
