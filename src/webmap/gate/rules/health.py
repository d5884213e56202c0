"""The health of the bridge, the display, the odometry and the camera. No I/O."""

import math
from bisect import bisect_left, insort
from collections import deque

from webmap.base.geometry import Twist
from webmap.gate.actions import Emit, PingOften, Watch
from webmap.gate.events import Key

WINDOW = 2.0
"""Seconds over which ages are counted."""


class Ages:
    """The ages of the last :data:`WINDOW`, in seconds."""

    def __init__(self) -> None:
        self._ages: deque[tuple[float, float]] = deque()
        self._sorted: list[float] = []

    def add(self, age: float, now: float) -> None:
        """Add an age in seconds, and drop those from before the window."""
        self._ages.append((now, age))
        insort(self._sorted, age)
        self.forget_old(now)

    def forget_old(self, now: float) -> None:
        """Forget the ages from before the window."""
        while self._ages and now - self._ages[0][0] > WINDOW:
            _, age = self._ages.popleft()
            del self._sorted[bisect_left(self._sorted, age)]

    def clear(self) -> None:
        """Forget everything."""
        self._ages.clear()
        self._sorted.clear()

    @property
    def p95(self) -> float | None:
        """The 95th percentile in seconds, if there are ages."""
        if not self._sorted:
            return None
        return self._sorted[math.ceil(0.95 * len(self._sorted)) - 1]


PROOF_LIMIT = 0.3
"""Seconds since the newest answered ping was sent, at most, for writing a velocity
other than zero; when the answer arrived does not matter (S11)."""

STALL_LIMIT = 1.0
"""Seconds without an answer after which a link is cut (S11)."""

BEAT_LIMIT = 0.25
"""Seconds without a heartbeat after which the display counts as not responding."""


class LinkHealth:
    """Whether a link is up, and which ping its far end last answered.

    An answer proves the state of the link at the time of its ping and not later: it
    may have been in flight for long, and data written since may be stuck in a buffer.
    """

    def __init__(self) -> None:
        self.up = False
        self.trips = Ages()
        """The round trips of the pings, or of the velocities, in seconds."""
        self.answered_at = float("-inf")
        """When the newest answer came, or the link was opened."""
        self.only_echoes = False
        """Whether an answer proves only that the connection works, see ``delivery``."""
        self.actions: frozenset[str] = frozenset()
        """The actions that a bridge of Foxglove offers, or offered before."""
        self._ping_at = float("-inf")

    def opened(self, now: float, *, only_echoes: bool = False) -> None:
        """Note that the link is up; none of its pings is answered yet."""
        self.up, self.only_echoes = True, only_echoes
        self._ping_at, self.answered_at = float("-inf"), now
        self.trips.clear()

    def closed(self) -> None:
        """Note that the socket to the bridge has closed."""
        self.up = False

    def answered(self, asked_at: float, now: float) -> None:
        """Note that the ping of ``asked_at`` was answered at ``now``."""
        self._ping_at = max(self._ping_at, asked_at)
        self.answered_at = now
        if not self.only_echoes:
            self.trips.add(now - asked_at, now)

    def answered_since(self, then: float) -> bool:
        """Return whether a ping sent after ``then`` was answered.

        If so, the data written at ``then`` has arrived, because the order is kept.
        """
        return self.up and self._ping_at > then

    def fresh(self, now: float) -> bool:
        """Return whether a velocity other than zero may be written at ``now``."""
        return self.up and now - self._ping_at <= PROOF_LIMIT

    def stalled(self, now: float) -> bool:
        """Return whether the link is open but carries nothing."""
        return self.up and now - self.answered_at > STALL_LIMIT


class DisplayPulse:
    """Whether the display process responds, and with it every page and program."""

    def __init__(self) -> None:
        self.ended: str | None = None
        self._beat_at = float("-inf")

    def beat(self, now: float) -> None:
        """Note a heartbeat of the display, at ``now`` in seconds."""
        self._beat_at = now

    def fault(self, now: float) -> str | None:
        """Return why no page or program may move a machine, or ``None``."""
        if self.ended is not None:
            return self.ended
        if now - self._beat_at > BEAT_LIMIT:
            return "the display process does not respond"
        return None


STILL_V = 0.02
"""Metres per second below which a machine has stopped (S5)."""

STILL_W = 0.05
"""Radians per second below which a machine has stopped (S5)."""

STILL_FOR = 0.3
"""Seconds for which odometry must show standstill without a gap (S5)."""

GAP = 0.5
"""Seconds between two odometry messages above which motion may have been missed."""


def moves(twist: Twist, still_v: float = STILL_V, still_w: float = STILL_W) -> bool:
    """Return whether a machine with that velocity moves.

    Args:
        twist: The velocity that odometry reports.
        still_v: Metres per second at and above which it moves.
        still_w: Radians per second at and above which it turns.

    """
    return twist.speed >= still_v or twist.turn >= still_w


class Standstill:
    """Watches odometry from :meth:`begin` on for a lasting standstill.

    Args:
        still_v: Metres per second at and above which the machine moves.
        still_w: Radians per second at and above which it turns.

    """

    def __init__(self, still_v: float = STILL_V, still_w: float = STILL_W) -> None:
        self._still_v, self._still_w = still_v, still_w
        self.speed: float | None = None
        """The newest speed in m/s; ``None`` before the first."""
        self.turn = 0.0
        """The newest rate of turn in rad/s, whatever the axis."""
        self.heard_at = float("-inf")
        """When the last odometry with a velocity arrived."""
        self.gap = 0.0
        """Seconds between the newest two messages; 0 before there are two."""
        self.since: float | None = None
        """When the present standstill began; ``None`` if the machine moves."""

    def begin(self) -> None:
        """Forget all earlier odometry."""
        self.speed, self.heard_at, self.since = None, float("-inf"), None
        self.gap = 0.0

    def observe(self, twist: Twist | None, now: float) -> None:
        """Process an odometry message; ``None`` is a message without a velocity."""
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
        """Whether the standstill has lasted for :data:`STILL_FOR`."""
        return self.since is not None and self.heard_at - self.since >= STILL_FOR


BLIND_LIMIT = 1.0
"""The greatest age of odometry and of the camera picture for driving, in seconds (S16).

Odometry is as old as the newest ping that was answered before it arrived: a link may
have delayed both.
"""


class Observation:
    """The newest echo and the newest odometry of one machine.

    Args:
        key: The machine.
        emit: Called with each action.

    """

    def __init__(self, key: Key, emit: Emit) -> None:
        self.on = False
        self.echoed: Twist | None = None
        self.measured: Twist | None = None
        self._seen: tuple[float, float] | None = None
        """A time before the newest velocity was sent, and its time of arrival."""
        self._often = True
        self._key = key
        self._emit = emit

    def update(self, on: bool, often: bool = True) -> None:
        """Subscribe to echo and odometry, and ping often; or unsubscribe and forget."""
        if on != self.on:
            self.on, self._often = on, True
            self._emit(Watch(self._key, on))
        if on and often != self._often:
            self._often = often
            self._emit(PingOften(self._key, often))
        if not on:
            self.measured = self.echoed = self._seen = None

    def observe(self, measured: Twist | None, sent_after: float, now: float) -> None:
        """Process an odometry message; without a velocity it refreshes nothing.

        Args:
            measured: The velocity in the message, if it has one.
            sent_after: A time after which it was sent.
            now: The time, at which it arrived.

        """
        self.measured = measured
        if measured is not None:
            self._seen = (min(sent_after, now), now)

    def shown(self, now: float) -> Twist | None:
        """Return the newest velocity of odometry, if it arrived lately enough."""
        if self._seen is None or now - self._seen[1] > BLIND_LIMIT:
            return None
        return self.measured

    def fault(self, now: float) -> str | None:
        """Return why odometry does not show the motion now, as text, or ``None``."""
        if self._seen is None:
            return "no odometry yet"
        sent_after, came_at = self._seen
        if now - came_at > BLIND_LIMIT:
            return f"no odometry for {BLIND_LIMIT:g} s"
        if now - sent_after > BLIND_LIMIT:
            return f"odometry is more than {BLIND_LIMIT:g} s late"
        return None

    def shows_since(self, then: float) -> bool:
        """Return whether the newest odometry counts for the time after ``then``.

        Standstill counts if it was sent after ``then``. Motion always counts, however
        late it arrives: nothing shows that it has ended.
        """
        if self.measured is None or self._seen is None:
            return False
        return self._seen[0] >= then or moves(self.measured)

    def on_echo(self, twist: Twist) -> None:
        """Note a velocity received on the velocity topic."""
        if self.on:
            self.echoed = twist


class Video:
    """The age of the camera picture that the holder of the lease looks at.

    The gate receives no pictures. Each command states the age of the newest picture
    that its page showed, so a frozen camera, a hanging display and a page that receives
    nothing all have the same effect.
    """

    def __init__(self) -> None:
        self._taken_at: float | None = None

    def observe(self, age: float | None, now: float) -> None:
        """Note the age of the picture in seconds; ``None`` if no camera is chosen."""
        self._taken_at = None if age is None else now - age

    def forget(self) -> None:
        """Forget the picture: the machine is not driven any more."""
        self._taken_at = None

    def fault(self, now: float) -> str | None:
        """Return that the driver sees no picture, as text, or ``None``."""
        if self._taken_at is None or now - self._taken_at <= BLIND_LIMIT:
            return None
        return f"no picture from the camera for {BLIND_LIMIT:g} s"
