"""The STOP of one machine: saved on disk, confirmed by odometry, reset. No I/O.

All gates on a computer share the STOP file of a machine; only one of them has the
machine. If another gate receives STOP, the gate that has the machine finds it in the
file.

STOP is active from the moment it is set. It is acknowledged only when the disk has
answered: a STOP that was saved is active again after a crash of this process or this
computer.

Each press is a STOP with its own identity, also while an earlier one is active. A
reset names the press that a person saw, so it cannot end a newer one.
"""

import secrets

from webmap.base.geometry import Twist
from webmap.base.text import isolated
from webmap.gate.actions import Emit, SaveStop
from webmap.gate.commands import Refusal
from webmap.gate.events import Key, Press, StopSaved
from webmap.gate.protocol import Identity
from webmap.gate.rules.aliases import Aliases
from webmap.gate.rules.delivery import Delivery
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


def new_press(by: str, identity: Identity | None) -> Press:
    """Return a press of STOP with a new identity.

    Args:
        by: The name of the person or program that pressed STOP.
        identity: That of the person.

    """
    return Press(by, secrets.token_hex(8), identity)


def newer_stop(press: Press) -> str:
    """Return why a reset does not end this STOP, for the person who reset."""
    by = isolated(press.by)
    return f"{by} pressed STOP meanwhile; look at the robot, then press Reset again"


class StopLatch:
    """Whether STOP is active for one machine, and whether that is on disk.

    Args:
        key: The machine.
        emit: Called with each action.

    """

    def __init__(self, key: Key, emit: Emit) -> None:
        self.press: Press | None = None
        """The newest press; ``None`` if STOP is not active."""
        self.shown: Press | None = None
        """The newest acknowledged press, which the pages show."""
        self.trouble: str | None = None
        """Why it could not be saved on disk, as text."""
        self._key = key
        self._emit = emit
        self._number = 0
        self.settled = True
        """Whether no save is pending."""
        self._save_next = False
        self._saving: Press | None = None
        self._ids: set[str] = set()
        """The identities of the presses of this STOP that may be in the file."""

    @property
    def by(self) -> str | None:
        """The name of who pressed STOP last; ``None`` if STOP is not active."""
        return None if self.press is None else isolated(self.press.by)

    @property
    def on(self) -> bool:
        """Whether STOP is active."""
        return self.press is not None

    @property
    def acknowledged(self) -> bool:
        """Whether STOP is active and its save has ended, with or without an error."""
        return self.shown is not None

    def set(self, press: Press) -> None:
        """Activate STOP, with ``press`` as the newest press."""
        waiting = self.on and not self.settled
        self.press = press
        if waiting:  # one write at a time; the next one has the newest press
            self._save_next = True
        else:
            self.save()

    def found(self, press: Press) -> None:
        """Take over a press that an earlier or another gate saved on disk."""
        self.press = self.shown = press
        self.trouble = None
        self._ids.add(press.id)

    def is_new(self, press: Press | None) -> bool:
        """Return whether ``press``, read from the file, is new to this gate."""
        if press is None or press == self.press:
            return False
        # A press that is being saved, or could not be saved, is newer than the file.
        return self.settled and not (self.on and self.trouble)

    def drop(self) -> None:
        """Deactivate STOP here only; another gate is responsible for the file."""
        self.press = self.shown = None
        self._ids.clear()

    def check(self, stop: str) -> None:
        """Check that a reset names the newest press.

        Args:
            stop: The identity of the press that the reset names.

        Raises:
            Refusal: If STOP is not active, or a newer press is.

        """
        if self.press is None:
            raise Refusal("no STOP is active")
        if self.press.id != stop:
            raise Refusal(newer_stop(self.press))

    def reset(self) -> None:
        """End the STOP, also on disk."""
        self.press = self.shown = None
        self.save()
        self._ids.clear()

    def kept(self, event: StopSaved) -> None:
        """Note the result of a save; only the newest save counts."""
        if event.number != self._number:
            return
        self.settled, self.trouble = True, event.error
        self.shown = self._saving
        if self._save_next:
            self.save()
        elif self.shown is not None and event.error is None:
            self._ids = {self.shown.id}

    def save(self) -> None:
        """Save the current state."""
        self._number += 1
        self.settled, self.trouble, self._save_next = False, None, False
        self._saving = self.press
        if self.press is not None:
            self._ids.add(self.press.id)
        ids = frozenset(self._ids)
        self._emit(SaveStop(self._key, self._number, self.press, ids))


PATIENCE = 2.0
"""Seconds after STOP during which the confirmation may be unknown (``None``).

After that it is ``False``.
"""


class Confirmation:
    """Confirms by odometry that the machine has stopped since STOP.

    It stays confirmed as long as odometry keeps coming and shows no motion.
    """

    def __init__(self) -> None:
        self.confirmed: bool | None = None
        self.why = ""
        """The reason as text; empty while ``confirmed`` is ``None``."""
        self.since = float("-inf")
        self._still = Standstill()
        self._stopped = False

    def begin(self, now: float) -> None:
        """Start anew at ``now``: odometry from before proves nothing."""
        self.confirmed, self.why, self.since = None, "", now
        self._stopped = False
        self._still.begin()

    def observe(self, twist: Twist | None, now: float) -> None:
        """Process an odometry message; motion ends the confirmation."""
        self._still.observe(twist, now)
        if self.confirmed and twist is not None and moves(twist):
            self.confirmed, self.why = False, self._moving()

    def judge(self, trouble: str | None, delivered: bool, now: float) -> None:
        """Update ``confirmed`` and ``why``.

        Args:
            trouble: Why standstill cannot be observed at all now, as text, or
                ``None``.
            delivered: Whether the machine's bridge answered since STOP.
            now: The time.

        """
        silent = now - self._still.heard_at > PATIENCE
        if trouble is not None:
            self.confirmed, self.why = False, self._since_then(trouble)
        elif self._still.reached and delivered and not silent:
            self.confirmed, self.why = True, "stopped, confirmed by odometry"
            self._stopped = True
        elif self.confirmed and not silent:
            pass  # odometry had a gap, which does not mean motion
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
        return f"the robot stopped, but now: {trouble}" if self._stopped else trouble

    def _moving(self) -> str:
        speed = self._still.speed or 0.0
        if speed < STILL_V:
            return f"still turning at {self._still.turn:.2f} rad/s"
        return f"still moving at {speed:.2f} m/s"


class ActiveStop:
    """The STOP of one machine, from the first zero to the reset.

    Args:
        key: The machine.
        latch: Whether STOP is active.
        robots: The robots that are declared for the machine.
        control: Whether its velocities arrive.
        motion: Writes the zeros.

    """

    def __init__(
        self,
        key: Key,
        latch: StopLatch,
        robots: Aliases,
        control: Delivery,
        motion: Motion,
    ) -> None:
        self.latch = latch
        self.confirmation = Confirmation()
        self._url = key.url
        self._robots = robots
        self._control = control
        self._motion = motion

    @property
    def proved(self) -> bool:
        """Whether odometry shows standstill, and every stop hook arrived."""
        return self.confirmation.confirmed is True and self._robots.hooks_done

    def press(self, press: Press, now: float) -> None:
        """Activate STOP; zero is sent before everything else."""
        if self._robots.drivable:
            self._motion.zero(now)
        self.latch.set(press)
        self.send_all(now)

    def send_all(self, now: float) -> None:
        """Send zeros, cancels and stop hooks, as far as links are up."""
        if self._robots.drivable:
            self._motion.hold(now)
        for goals in self._robots.goals.values():
            goals.stop(now)
        for hooks in self._robots.hooks.values():
            hooks.send(stopped=True)
        self.confirmation.begin(now)
        self.confirm(now)

    def reset(self, stop: str) -> None:
        """Deactivate STOP; nothing moves by it.

        Args:
            stop: The identity of the press that the reset names.

        Raises:
            Refusal: If STOP is not active, or a newer press is.

        """
        self.latch.check(stop)
        self.latch.reset()
        self._motion.release_hold()
        for hooks in self._robots.hooks.values():
            hooks.send(stopped=False)

    def on_file_changed(self, press: Press | None, elsewhere: bool) -> bool:
        """Process a change of the STOP file that this gate did not make.

        Args:
            press: The press in the file, if there is one.
            elsewhere: Whether another gate has the machine.

        Returns:
            Whether this gate must take over ``press``, a STOP of another gate.

        """
        latch = self.latch
        if press is not None:
            new = latch.is_new(press)
            if new and elsewhere and latch.on:
                latch.found(press)
            return new and not elsewhere
        if not latch.settled or not latch.on:
            return False
        if elsewhere:  # the gate that has the machine reset it; this gate only watches
            latch.drop()
            self._motion.release_hold()
            for hooks in self._robots.hooks.values():
                hooks.drop()
        else:
            latch.save()  # a removed file is no reset
        return False

    def take_over(self, press: Press, now: float) -> None:
        """Activate the STOP of another gate; zero is sent first."""
        if self._robots.drivable:
            self._motion.zero(now)
        self.latch.found(press)
        self.send_all(now)

    def tasks_down(self, link: LinkHealth, now: float) -> None:
        """Note that the last cancels may not have arrived: their link is down."""
        for goals in self._robots.goals.values():
            if goals.link is link:
                goals.link_down(now)

    def tasks_up(self, link: LinkHealth, now: float) -> None:
        """Send cancels and stop hooks that could not be sent or may be lost."""
        for goals in self._robots.goals.values():
            if goals.link is link and self.latch.on:
                goals.stop(now)
            elif goals.link is link:
                goals.link_up(now)
        for hooks in self._robots.hooks.values():
            if hooks.link is link and self.latch.on:
                hooks.send(stopped=True)
            elif hooks.link is link:
                hooks.link_up()

    def confirm(self, now: float) -> None:
        """Judge whether the machine stands, by the odometry up to ``now``."""
        drivable = self._robots.drivable
        since = self.confirmation.since
        delivered = not drivable or self._control.answered_since(since)
        self.confirmation.judge(self._why_unobservable(drivable), delivered, now)

    def _why_unobservable(self, drivable: bool) -> str | None:
        """Return why standstill cannot be observed, as text, or ``None``."""
        robots = self._robots
        goals = robots.goals[robots.newest.id]
        if not (self._control.up if drivable else goals.link.up):
            return f"no connection to {self._url}"
        return None if robots.has_odometry else "no odometry"
