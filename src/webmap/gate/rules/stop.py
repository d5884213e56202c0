"""The STOP of one machine: kept on disk, confirmed by odometry, reset. No I/O.

The file of it is common to all gates on a computer, of which one alone may have the
machine. A STOP that is said to another one is found there by the gate that has it.

It holds from the moment it is set. That it is acknowledged is another thing: that
waits until the disk has it, so that a STOP which was confirmed to anybody is there
again after whatever happens to this process or this computer.

Each press is a STOP of its own, also while an earlier one stands. A reset names the
press that a person saw, so it cannot end a newer one.
"""

import secrets

from webmap.base.geometry import Twist
from webmap.gate.actions import Emit, SaveStop
from webmap.gate.commands import Refusal
from webmap.gate.events import Key, Press, StopSaved
from webmap.gate.rules.aliases import Aliases
from webmap.gate.rules.health import (
    GAP,
    STILL_FOR,
    STILL_V,
    STILL_W,
    LinkHealth,
    Standstill,
    moves,
)
from webmap.gate.rules.motion import Motion


def new_press(by: str) -> Press:
    """Return a press of STOP that is unlike every other one.

    Args:
        by: Who pressed STOP, for people.

    """
    return Press(by, secrets.token_hex(8))


class StopLatch:
    """Whether STOP stands for one machine, and whether the disk knows.

    Args:
        key: The machine.
        emit: Takes the actions.

    """

    def __init__(self, key: Key, emit: Emit) -> None:
        self.press: Press | None = None
        """The newest press; ``None`` if no STOP stands."""
        self.shown: Press | None = None
        """The newest press that is acknowledged. It is the one that people see."""
        self.trouble: str | None = None
        """Why the disk does not have it, in words."""
        self._key = key
        self._emit = emit
        self._number = 0
        self._kept = True
        self._keep_next = False
        self._keeping: Press | None = None
        self._ids: set[str] = set()
        """The presses of this STOP that may be in the file."""

    @property
    def by(self) -> str | None:
        """Who pressed STOP last, for people; ``None`` if it does not stand."""
        return None if self.press is None else self.press.by

    @property
    def on(self) -> bool:
        """Whether STOP stands."""
        return self.press is not None

    @property
    def acknowledged(self) -> bool:
        """Whether STOP stands and everything was done that it will stand."""
        return self.shown is not None

    def set(self, press: Press) -> None:
        """Have STOP stand from now on, by the newest press."""
        waiting = self.on and not self._kept
        self.press = press
        if waiting:  # the disk gets one press after the other, and skips to the newest
            self._keep_next = True
        else:
            self._keep()

    def found(self, press: Press) -> None:
        """Take over what an earlier gate left on disk, or another one put there."""
        self.press = self.shown = press
        self._ids.add(press.id)

    def is_new(self, press: Press | None) -> bool:
        """Return whether the file has a press that this gate does not know.

        Args:
            press: The press in the file, if there is one.

        """
        if press is None or press == self.press:
            return False
        # What is being written, or could not be, is newer than what is in the file.
        return self._kept and not (self.on and self.trouble)

    @property
    def settled(self) -> bool:
        """Whether the disk has what holds here, as far as it can."""
        return self._kept

    def save_again(self) -> None:
        """Keep what holds: somebody took the file away."""
        self._keep()

    def drop(self) -> None:
        """Let STOP stand no longer here; what is on disk is another gate's matter."""
        self.press = self.shown = None
        self._ids.clear()

    def check(self, stop: str) -> None:
        """Let a reset pass that names the newest press.

        Args:
            stop: The identity of the press that the reset is to end.

        Raises:
            Refusal: If no STOP stands, or a newer one does.

        """
        if self.press is None:
            raise Refusal("no STOP is active")
        if self.press.id != stop:
            raise Refusal(
                f"{self.press.by} pressed STOP meanwhile; look at the robot, then "
                "press Reset again"
            )

    def reset(self) -> None:
        """Let STOP stand no longer."""
        self.press = self.shown = None
        self._keep()
        self._ids.clear()

    def kept(self, event: StopSaved) -> None:
        """Note what became of keeping it; only the newest state counts."""
        if event.number != self._number:
            return
        self._kept, self.trouble = True, event.error
        self.shown = self._keeping
        if self._keep_next:
            self._keep()
        elif self.shown is not None and event.error is None:
            self._ids = {self.shown.id}

    def _keep(self) -> None:
        self._number += 1
        self._kept, self.trouble, self._keep_next = False, None, False
        self._keeping = self.press
        if self.press is not None:
            self._ids.add(self.press.id)
        ids = frozenset(self._ids)
        self._emit(SaveStop(self._key, self._number, self.press, ids))


PATIENCE = 2.0
"""Seconds after STOP until "not known yet" becomes "not confirmed"."""


class Confirmation:
    """Looks at odometry from a STOP on for standstill, and on for motion. No I/O.

    What was confirmed is so as long as odometry goes on to say it.
    """

    def __init__(self) -> None:
        self.confirmed: bool | None = None
        self.why = ""
        """The reason in words; empty while it is not known yet."""
        self.since = float("-inf")
        self._still = Standstill()
        self._stood = False

    def begin(self, now: float) -> None:
        """Look (again) from ``now`` on: what was seen before proves nothing."""
        self.confirmed, self.why, self.since = None, "", now
        self._stood = False
        self._still.begin()

    def observe(self, twist: Twist | None, now: float) -> None:
        """Take in a message of odometry; one that moves again is not confirmed."""
        self._still.observe(twist, now)
        if self.confirmed and twist is not None and moves(twist):
            self.confirmed, self.why = False, self._moving()

    def judge(self, trouble: str | None, delivered: bool, now: float) -> None:
        """Decide anew.

        Args:
            trouble: Why nothing can be known at all now, in words.
            delivered: Whether the robot's bridge answered since STOP.
            now: The time.

        """
        silent = now - self._still.heard_at > PATIENCE
        if trouble is not None:
            self.confirmed, self.why = False, self._since_then(trouble)
        elif self._still.reached and delivered and not silent:
            self.confirmed, self.why = True, "stopped, confirmed by odometry"
            self._stood = True
        elif self.confirmed and not silent:
            pass  # odometry had a gap, which is no motion
        elif now - self.since < PATIENCE:
            self.confirmed, self.why = None, ""
        else:
            self.confirmed, self.why = False, self._reason(delivered, silent, now)

    def _reason(self, delivered: bool, silent: bool, now: float) -> str:
        if not delivered:
            return self._since_then("no answer from the bridge")
        if self._still.speed is None or silent:
            return self._since_then("no odometry")
        if self._still.speed < STILL_V and self._still.turn < STILL_W:
            gap = max(self._still.gap, now - self._still.heard_at)
            if gap > GAP:
                return f"only one odometry message in {gap:.1f} s"
            return f"not yet still for {STILL_FOR:g} s"
        return self._moving()

    def _since_then(self, trouble: str) -> str:
        return f"it stopped, but since then: {trouble}" if self._stood else trouble

    def _moving(self) -> str:
        speed = self._still.speed or 0.0
        if speed < STILL_V:
            return f"still turning at {self._still.turn:.2f} rad/s"
        return f"still moving at {speed:.2f} m/s"


class ActiveStop:
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
        latch: StopLatch,
        robots: Aliases,
        control: LinkHealth,
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
        self.send_all(now)

    def send_all(self, now: float) -> None:
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
        self._motion.release_hold()
        for hooks in self._robots.hooks.values():
            hooks.say(stopped=False)

    def on_file_changed(self, press: Press | None, elsewhere: bool) -> bool:
        """Note that the file of the STOP changed, by another hand than this gate's.

        Args:
            press: The STOP that it says stands, if one does.
            elsewhere: Whether another gate has the machine.

        Returns:
            Whether a STOP is to be taken over that was said to another gate.

        """
        latch = self.latch
        if press is not None:
            news = latch.is_new(press)
            if news and elsewhere and latch.on:
                latch.found(press)
            return news and not elsewhere
        if not latch.settled or not latch.on:
            return False
        if elsewhere:  # it was reset where the machine is, and this is an onlooker
            latch.drop()
            self._motion.release_hold()
            for hooks in self._robots.hooks.values():
                hooks.drop()
        else:
            latch.save_again()  # a file that is gone is no reset
        return False

    def take_over(self, press: Press, now: float) -> None:
        """Have it stand because another gate was told so; zero goes first."""
        if self._robots.drivable:
            self._motion.zero(now)
        self.latch.found(press)
        self.send_all(now)

    def tasks_down(self, link: LinkHealth, now: float) -> None:
        """Note that what was said last may not have arrived: a link is lost."""
        for goals in self._robots.goals.values():
            if goals.link is link:
                goals.link_down(now)

    def tasks_up(self, link: LinkHealth, now: float) -> None:
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
