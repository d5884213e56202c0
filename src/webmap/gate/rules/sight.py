"""What is heard of a machine, while there is a reason to listen. No I/O."""

from webmap.base.geometry import Twist
from webmap.gate.actions import Emit, Watch
from webmap.gate.events import Key
from webmap.gate.rules.standstill import moves

BLIND_LIMIT = 1.0
"""The oldest velocity that odometry told, or picture, with which a machine is driven,
in seconds (S16). A velocity is as old as the newest question that was answered before
it came: a link may have kept both."""


class Sight:
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

    def saw(self, measured: Twist | None, said_after: float, now: float) -> None:
        """Note that odometry came; what tells no velocity shows nobody anything.

        Args:
            measured: The velocity that it tells, if it tells one.
            said_after: A moment after which it was said.
            now: The time, at which it came.

        """
        self.measured = measured
        if measured is not None:
            self._seen = (min(said_after, now), now)

    def shown(self, now: float) -> Twist | None:
        """Return the newest velocity that odometry told, unless that is long ago."""
        if self._seen is None or now - self._seen[1] > BLIND_LIMIT:
            return None
        return self.measured

    def doubt(self, now: float) -> str | None:
        """Return why nobody knows by odometry how it moves now, in words."""
        if self._seen is None:
            return "no odometry yet"
        said_after, came_at = self._seen
        if now - came_at > BLIND_LIMIT:
            return f"no odometry for {BLIND_LIMIT:g} s"
        if now - said_after > BLIND_LIMIT:
            return f"odometry is more than {BLIND_LIMIT:g} s late"
        return None

    def tells_since(self, then: float) -> bool:
        """Return whether the newest odometry tells anything of the time after ``then``.

        Of standstill it does if it was said after that. Motion counts however late it
        comes: nothing says that it has ended.
        """
        if self.measured is None or self._seen is None:
            return False
        return self._seen[0] >= then or moves(self.measured)

    def saw_echo(self, twist: Twist) -> None:
        """Note what the robot's ROS says on the velocity topic."""
        if self.on:
            self.echoed = twist
