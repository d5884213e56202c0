"""What is known of the other ends: bridge, display, odometry and camera. No I/O."""

import math
from collections import deque

from webmap.base.geometry import Twist
from webmap.gate.actions import Emit, Watch
from webmap.gate.events import Key

WINDOW = 2.0
"""Seconds over which ages are looked at."""


class Ages:
    """Ages in seconds, the newest ones."""

    def __init__(self) -> None:
        self._ages: deque[tuple[float, float]] = deque()
        self._p95: float | None = None
        self._stale = False

    def add(self, age: float, now: float) -> None:
        """Count one more; ``age`` in seconds."""
        self._ages.append((now, age))
        self._stale = True
        self.forget_old(now)

    def forget_old(self, now: float) -> None:
        """Look at the last two seconds only."""
        while self._ages and now - self._ages[0][0] > WINDOW:
            self._ages.popleft()
            self._stale = True

    def clear(self) -> None:
        """Forget everything."""
        self._ages.clear()
        self._stale = True

    @property
    def p95(self) -> float | None:
        """The age in seconds that 95 of 100 stay below, if there is any."""
        if self._stale:
            ages = sorted(age for _, age in self._ages)
            self._p95 = ages[math.ceil(0.95 * len(ages)) - 1] if ages else None
            self._stale = False
        return self._p95


PROOF_LIMIT = 0.3
"""The oldest question whose answer counts when a moving command is written, in seconds:
how long ago it was asked, however lately the answer came (S11)."""

STALL_LIMIT = 1.0
"""A link that gave no sign of life for so long is cut, in seconds (S11)."""

BEAT_LIMIT = 0.25
"""The longest silence of the display that is not yet taken for its end, in seconds."""


class LinkHealth:
    """Whether a link is up, and which question its far end last answered.

    An answer tells of the moment when it was asked for, and of nothing after that: it
    may have been under way for long, and what was written meanwhile may lie somewhere.
    """

    def __init__(self) -> None:
        self.up = False
        self.trips = Ages()
        """How long questions and their answers were under way."""
        self._asked_at = float("-inf")
        self._heard_at = float("-inf")

    def opened(self, now: float) -> None:
        """The link is up; nothing that was asked on it is answered yet."""
        self.up = True
        self._asked_at, self._heard_at = float("-inf"), now
        self.trips.clear()

    def closed(self) -> None:
        """The link is down."""
        self.up = False

    def answered(self, asked_at: float, now: float) -> None:
        """The far end answered at ``now`` what it was asked at ``asked_at``."""
        self._asked_at = max(self._asked_at, asked_at)
        self._heard_at = now
        self.trips.add(now - asked_at, now)

    def answered_since(self, then: float) -> bool:
        """Return whether something was answered that was asked after ``then``.

        What was written at ``then`` has arrived if so, as all goes in order.
        """
        return self.up and self._asked_at > then

    def fresh(self, now: float) -> bool:
        """Return whether something that moves may be written at ``now``."""
        return self.up and now - self._asked_at <= PROOF_LIMIT

    def stalled(self, now: float) -> bool:
        """Return whether the link looks open but carries nothing."""
        return self.up and now - self._heard_at > STALL_LIMIT


class DisplayPulse:
    """Whether the display process, and so everybody behind it, is there."""

    def __init__(self) -> None:
        self.ended: str | None = None
        self._beat_at = float("-inf")

    def beat(self, now: float) -> None:
        """A heartbeat came."""
        self._beat_at = now

    def doubt(self, now: float) -> str | None:
        """Return why nobody behind the display may move anything, if so."""
        if self.ended is not None:
            return self.ended
        if now - self._beat_at > BEAT_LIMIT:
            return "the display process does not respond"
        return None


STILL_V = 0.02
"""Metres per second below which a machine stands (S5)."""

STILL_W = 0.05
"""Radians per second below which a machine stands (S5)."""

STILL_FOR = 0.3
"""Seconds for which odometry must say so without a gap (S5)."""

GAP = 0.5
"""Seconds between two messages that are too many to know what was between."""


def moves(twist: Twist, still_v: float = STILL_V, still_w: float = STILL_W) -> bool:
    """Return whether a machine of that velocity does not stand.

    Args:
        twist: What its odometry tells.
        still_v: Metres per second from which on it moves.
        still_w: Radians per second from which on it turns.

    """
    return twist.speed >= still_v or twist.turn >= still_w


class Standstill:
    """Listens to odometry from a moment on, until the machine has stood for long.

    Args:
        still_v: Metres per second from which on it moves.
        still_w: Radians per second from which on it turns.

    """

    def __init__(self, still_v: float = STILL_V, still_w: float = STILL_W) -> None:
        self._still_v, self._still_w = still_v, still_w
        self.speed: float | None = None
        """The newest speed in m/s; ``None`` before the first."""
        self.turn = 0.0
        """The newest speed of turning in rad/s, whatever the axis."""
        self.heard_at = float("-inf")
        """When odometry last told a velocity."""
        self.gap = 0.0
        """Seconds between the newest two messages; 0 before there are two."""
        self.since: float | None = None
        """When it was first seen to stand, if it has been seen so ever since."""

    def begin(self) -> None:
        """Forget what was heard before."""
        self.speed, self.heard_at, self.since = None, float("-inf"), None
        self.gap = 0.0

    def observe(self, twist: Twist | None, now: float) -> None:
        """Take in a message of odometry; ``None`` is one without a velocity."""
        if twist is None:
            return
        if self.speed is not None:
            self.gap = now - self.heard_at
        if self.gap > GAP:
            self.since = None
        self.speed, self.turn, self.heard_at = twist.speed, twist.turn, now
        if moves(twist, self._still_v, self._still_w):
            self.since = None
        elif self.since is None:
            self.since = now

    @property
    def reached(self) -> bool:
        """Whether the machine has stood for :data:`STILL_FOR`."""
        return self.since is not None and self.heard_at - self.since >= STILL_FOR


BLIND_LIMIT = 1.0
"""The oldest velocity that odometry told, or picture, with which a machine is driven,
in seconds (S16). A velocity is as old as the newest question that was answered before
it came: a link may have kept both."""


class Observation:
    """The newest echo and the newest odometry of one machine.

    Args:
        key: The machine.
        emit: Takes the actions.

    """

    def __init__(self, key: Key, emit: Emit) -> None:
        self.on = False
        self.echoed: Twist | None = None
        self.measured: Twist | None = None
        self._seen: tuple[float, float] | None = None
        """After when the newest velocity was said, and when it came."""
        self._key = key
        self._emit = emit

    def update(self, on: bool) -> None:
        """Listen, or no longer; what was heard before is forgotten then."""
        if on != self.on:
            self.on = on
            self._emit(Watch(self._key, on))
        if not on:
            self.measured = self.echoed = self._seen = None

    def observe(self, measured: Twist | None, sent_after: float, now: float) -> None:
        """Note that odometry came; what tells no velocity shows nobody anything.

        Args:
            measured: The velocity that it tells, if it tells one.
            sent_after: A moment after which it was said.
            now: The time, at which it came.

        """
        self.measured = measured
        if measured is not None:
            self._seen = (min(sent_after, now), now)

    def shown(self, now: float) -> Twist | None:
        """Return the newest velocity that odometry told, unless that is long ago."""
        if self._seen is None or now - self._seen[1] > BLIND_LIMIT:
            return None
        return self.measured

    def doubt(self, now: float) -> str | None:
        """Return why nobody knows by odometry how it moves now, in words."""
        if self._seen is None:
            return "no odometry yet"
        sent_after, came_at = self._seen
        if now - came_at > BLIND_LIMIT:
            return f"no odometry for {BLIND_LIMIT:g} s"
        if now - sent_after > BLIND_LIMIT:
            return f"odometry is more than {BLIND_LIMIT:g} s late"
        return None

    def shows_since(self, then: float) -> bool:
        """Return whether the newest odometry tells anything of the time after ``then``.

        Of standstill it does if it was said after that. Motion counts however late it
        comes: nothing says that it has ended.
        """
        if self.measured is None or self._seen is None:
            return False
        return self._seen[0] >= then or moves(self.measured)

    def on_echo(self, twist: Twist) -> None:
        """Note what the robot's ROS says on the velocity topic."""
        if self.on:
            self.echoed = twist


class Video:
    """What the holder of the lease says of the camera that they look at.

    The gate sees no pictures. Each command tells how old the newest one was that its
    page had shown, so a camera that freezes, a display that hangs and a page that is
    not sent anything any more are all the same to it.
    """

    def __init__(self) -> None:
        self._taken_at: float | None = None

    def observe(self, age: float | None, now: float) -> None:
        """Note the age of the picture in seconds, or that no camera was chosen."""
        self._taken_at = None if age is None else now - age

    def forget(self) -> None:
        """Nobody drives any more."""
        self._taken_at = None

    def doubt(self, now: float) -> str | None:
        """Return that the driver sees nothing, in words."""
        if self._taken_at is None or now - self._taken_at <= BLIND_LIMIT:
            return None
        return f"no picture from the camera for {BLIND_LIMIT:g} s"
