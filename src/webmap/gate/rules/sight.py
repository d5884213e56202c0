"""What is heard of a machine, while there is a reason to listen. No I/O."""

from webmap.gate.actions import Emit, Watch
from webmap.gate.events import Key
from webmap.geometry import Twist

BLIND_LIMIT = 1.0
"""The oldest velocity that odometry told, or picture, with which a machine is driven,
in seconds (S16)."""


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
        self.seen_at: float | None = None
        """When odometry last told a velocity."""
        self._key = key
        self._emit = emit

    def update(self, on: bool) -> None:
        """Listen, or no longer; what was heard before is forgotten then."""
        if on != self.on:
            self.on = on
            self._emit(Watch(self._key, on))
        if not on:
            self.measured = self.echoed = self.seen_at = None

    def saw(self, measured: Twist | None, now: float) -> None:
        """Note that odometry came; what tells no velocity shows nobody anything."""
        self.measured = measured
        if measured is not None:
            self.seen_at = now

    def saw_echo(self, twist: Twist) -> None:
        """Note what the robot's ROS says on the velocity topic."""
        if self.on:
            self.echoed = twist
