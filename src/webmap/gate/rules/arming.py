"""Whether a machine may be taken, and whether it may be driven now. No I/O."""

from webmap.gate.events import Key, LockState
from webmap.gate.rules.health import Health, Pulse
from webmap.gate.rules.latch import Latch
from webmap.gate.rules.robots import Robots
from webmap.gate.rules.sight import Sight
from webmap.gate.rules.video import Video


class Arming:
    """Everything outside of the driver's hands that stands against motion.

    Args:
        key: The machine.
        robots: The robots that it is.
        latch: Its STOP.
        control: The link that velocity goes to.
        pulse: Whether the display is there.
        sight: What is heard of it.

    """

    def __init__(
        self,
        key: Key,
        robots: Robots,
        latch: Latch,
        control: Health,
        pulse: Pulse,
        sight: Sight,
    ) -> None:
        self.lock = LockState(key, held=False)
        """Whether this gate alone on this computer has it."""
        self.video = Video()
        self._url = key.url
        self._robots = robots
        self._latch = latch
        self._control = control
        self._pulse = pulse
        self._sight = sight

    @property
    def stopped(self) -> bool:
        """Whether STOP stands."""
        return self._latch.on

    def obstacle(self, now: float) -> str | None:
        """Return why nobody can have the machine, in words."""
        if self._latch.on:
            return f"STOP by {self._latch.by} is active: reset it first"
        if not self.lock.held:
            return self.lock.why
        if doubt := self._pulse.doubt(now):
            return doubt
        if self._robots.drivable:
            return None if self._control.up else f"no connection to {self._url}"
        goals = self._robots.goals[self._robots.newest.id]
        if not goals.can_send:
            return "the robot has no velocity topic and no goal topic"
        return None if goals.link.up else "no connection to the bridge of its goals"

    def doubt(self, now: float) -> str | None:
        """Return why the machine must not be driven now, in words."""
        if reason := self.obstacle(now):
            return reason
        if not self._robots.drivable:
            return "the robot has no velocity topic"
        if not self._control.fresh(now):
            return f"no answer from {self._url}"
        if self._robots.has_odometry and (blind := self._sight.doubt(now)):
            return blind
        return self.video.doubt(now)
