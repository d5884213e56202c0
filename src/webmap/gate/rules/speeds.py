"""How fast one machine may go now, by everything that is known of it. No I/O."""

from webmap.gate.events import StopRecord
from webmap.gate.limits import Cap, Speed, caps_of, least, page_cap, speed_in_force
from webmap.gate.rules.health import Health
from webmap.gate.rules.loopage import LoopAge, governed
from webmap.gate.rules.motion import Bounds
from webmap.gate.rules.robots import Robots


class Speeds:
    """The speeds in force for one machine.

    Args:
        robots: The robots that it is.
        control: The link that velocity goes to.

    """

    def __init__(self, robots: Robots, control: Health) -> None:
        self.ages = LoopAge(control.trips)
        """How old its driver's picture of it is."""
        self.tested: StopRecord | None = None
        """What the last stop test that came to an end found, whenever that was."""
        self.page_cap = page_cap()
        """What the page of its driver asks for at most."""
        self._robots = robots

    @property
    def own(self) -> Speed:
        """What the robot allows, whoever drives it; infinity where it says nothing."""
        return least(self._caps())

    def _caps(self) -> list[Cap]:
        specs = self._robots.specs.values()
        return [cap for spec in specs for cap in caps_of(spec, self.tested)]

    @property
    def speed(self) -> Speed:
        """The speeds in force now."""
        speed = speed_in_force([*self._caps(), self.page_cap])
        return governed(speed, self.ages.slow, self.stop_time)

    @property
    def stop_time(self) -> float | None:
        """Seconds within which the machine stops by itself, if that is known."""
        if self.tested is not None:
            return self.tested.seconds
        return self._robots.stops_within

    def bounds(self) -> Bounds:
        """Return what the machine may do at most now."""
        robots = self._robots
        return Bounds(self.speed, robots.a_max, robots.holonomic, robots.axes)
