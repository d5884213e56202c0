"""A STOP that stands: what is said because of it, and what is known of it. No I/O."""

from webmap.gate.events import Key, Press
from webmap.gate.rules.confirm import Confirmation
from webmap.gate.rules.health import Health
from webmap.gate.rules.latch import Latch
from webmap.gate.rules.motion import Motion
from webmap.gate.rules.robots import Robots


class StandingStop:
    """The STOP of one machine, from the first zero to the reset.

    Args:
        key: The machine.
        latch: Whether it stands.
        robots: The robots that the machine is.
        control: The link that velocity goes to.
        motion: Writes the zeros.

    """

    def __init__(
        self,
        key: Key,
        latch: Latch,
        robots: Robots,
        control: Health,
        motion: Motion,
    ) -> None:
        self.latch = latch
        self.confirmation = Confirmation()
        self._url = key.url
        self._robots = robots
        self._control = control
        self._motion = motion

    def press(self, press: Press, now: float) -> None:
        """Have it stand from now on; zero goes before everything else."""
        if self._robots.drivable:
            self._motion.zero(now)
        self.latch.set(press)
        self.say_all(now)

    def say_all(self, now: float) -> None:
        """Say everything that it has to say, as far as there are links."""
        if self._robots.drivable:
            self._motion.hold(now)
        for goals in self._robots.goals.values():
            goals.stop(now)
        for hooks in self._robots.hooks.values():
            hooks.say(stopped=True)
        self.confirmation.begin(now)
        self.confirm(now)

    def reset(self, stop: str) -> None:
        """Have it stand no longer; nothing moves by that.

        Args:
            stop: The identity of the STOP that is to be ended.

        Raises:
            Refusal: If none stands, or a newer one does.

        """
        self.latch.check(stop)
        self.latch.reset()
        self._motion.let_go()
        for hooks in self._robots.hooks.values():
            hooks.say(stopped=False)

    def saw_file(self, press: Press | None, elsewhere: bool) -> bool:
        """Note that the file of the STOP changed, by another hand than this gate's.

        Args:
            press: The STOP that it says stands, if one does.
            elsewhere: Whether another gate has the machine.

        Returns:
            Whether a STOP is to be taken over that was said to another gate.

        """
        latch = self.latch
        if press is not None:
            news = latch.is_news(press)
            if news and elsewhere and latch.on:
                latch.found(press)
            return news and not elsewhere
        if not latch.settled or not latch.on:
            return False
        if elsewhere:  # it was reset where the machine is, and this is an onlooker
            latch.drop()
            self._motion.let_go()
            for hooks in self._robots.hooks.values():
                hooks.drop()
        else:
            latch.keep_again()  # a file that is gone is no reset
        return False

    def take_over(self, press: Press, now: float) -> None:
        """Have it stand because another gate was told so; zero goes first."""
        if self._robots.drivable:
            self._motion.zero(now)
        self.latch.found(press)
        self.say_all(now)

    def tasks_down(self, link: Health, now: float) -> None:
        """Note that what was said last may not have arrived: a link is lost."""
        for goals in self._robots.goals.values():
            if goals.link is link:
                goals.link_down(now)

    def tasks_up(self, link: Health, now: float) -> None:
        """Say what could not be said, or may not have arrived, for want of a link."""
        for goals in self._robots.goals.values():
            if goals.link is link and self.latch.on:
                goals.stop(now)
            elif goals.link is link:
                goals.link_up(now)
        for hooks in self._robots.hooks.values():
            if hooks.link is link and self.latch.on:
                hooks.say(stopped=True)
            elif hooks.link is link:
                hooks.link_up()

    def confirm(self, now: float) -> None:
        """Decide anew whether it is confirmed."""
        since = self.confirmation.since
        delivered = not self._robots.drivable or self._control.answered_since(since)
        self.confirmation.judge(self._cannot_tell(), delivered, now)

    def _cannot_tell(self) -> str | None:
        """Return why nobody can tell whether the machine stands, in words."""
        robots = self._robots
        link = self._control
        if not robots.drivable:
            link = robots.goals[robots.newest.id].link
        if not link.up:
            return f"no connection to {self._url}"
        return None if robots.has_odometry else "no odometry"
