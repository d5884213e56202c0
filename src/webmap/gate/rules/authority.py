"""Who has control of one machine, and how control changes. No I/O.

::

    asked ── granted, or 10 s without an answer, or the holder let go ──▶ changing
      │                                                                     │
      └─ denied, withdrawn, STOP ──▶ nobody                standstill ──────┴──▶ given

While it changes hands nobody has it, and zero is all that is written.
"""

from collections.abc import Callable

from webmap.base.geometry import Twist
from webmap.gate.commands import Refusal
from webmap.gate.events import Key, LockState
from webmap.gate.limits import Cap, page_cap
from webmap.gate.rules.aliases import Aliases
from webmap.gate.rules.connections import Connection, Epochs, Lease
from webmap.gate.rules.health import (
    DisplayPulse,
    LinkHealth,
    Observation,
    Standstill,
    Video,
)
from webmap.gate.rules.motion import DeadMan, Motion
from webmap.gate.rules.speeds import Speeds
from webmap.gate.rules.stop import StopLatch


class MotionConditions:
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
        robots: Aliases,
        latch: StopLatch,
        control: LinkHealth,
        pulse: DisplayPulse,
        sight: Observation,
    ) -> None:
        self.lock = LockState(key, held=False)
        """Whether this gate alone on this computer has it."""
        self.video = Video()
        self._url = key.url
        self._robots = robots
        self._latch = latch
        self._control = control
        self._display_pulse = pulse
        self._observation = sight

    @property
    def stopped(self) -> bool:
        """Whether STOP stands."""
        return self._latch.on

    def why_unavailable(self, now: float) -> str | None:
        """Return why nobody can have the machine, in words."""
        if self._latch.on:
            return f"STOP by {self._latch.by} is active: reset it first"
        if not self.lock.held:
            return self.lock.why
        if doubt := self._display_pulse.doubt(now):
            return doubt
        if self._robots.drivable:
            return None if self._control.up else f"no connection to {self._url}"
        goals = self._robots.goals[self._robots.newest.id]
        if not goals.can_send:
            return "the robot has no velocity topic and no goal topic"
        return None if goals.link.up else "no connection to the bridge of its goals"

    def doubt(self, now: float) -> str | None:
        """Return why the machine must not be driven now, in words."""
        if reason := self.why_unavailable(now):
            return reason
        if not self._robots.drivable:
            return "the robot has no velocity topic"
        if not self._control.fresh(now):
            return f"no answer from {self._url}"
        if self._robots.has_odometry and (blind := self._observation.doubt(now)):
            return blind
        return self.video.doubt(now)


ASKING = 10.0
"""Seconds after which a holder who does not answer has granted it."""

WITHOUT_SIGHT = 1.0
"""Seconds after zero that are taken for standstill where no odometry tells."""


class Handover:
    """The way of one machine from one pair of hands to another."""

    def __init__(self) -> None:
        self.asker: Connection | None = None
        self.successor: Connection | None = None
        """Who gets it as soon as it stands."""
        self._asked_at = float("-inf")
        self.since = float("-inf")
        """When zero was written to have it stand."""
        self._still = Standstill()

    @property
    def going_on(self) -> bool:
        """Whether time may make a difference."""
        return self.asker is not None or self.successor is not None

    def ask(self, who: Connection, now: float) -> None:
        """Ask the holder; asked again, nothing changes.

        Raises:
            Refusal: If somebody else is asking.

        """
        if self.asker is None:
            self.asker, self._asked_at = who, now
        elif self.asker is not who:
            raise Refusal(
                f"{self.asker.name or self.asker.id} has already requested control"
            )

    def left(self, now: float) -> float:
        """Return the seconds until it is granted by itself."""
        return max(0.0, self._asked_at + ASKING - now)

    def begin(self, successor: Connection, now: float) -> None:
        """Wait for standstill, zero having been written at ``now``."""
        self.asker, self.successor, self.since = None, successor, now
        self._still.begin()

    def observe(self, twist: Twist | None, now: float) -> None:
        """Take in a message of odometry."""
        self._still.observe(twist, now)

    def is_still(self, now: float) -> bool:
        """Return whether it is standing, as far as anybody can tell."""
        if self._still.reached:
            return True
        heard = max(self.since, self._still.heard_at)
        return now - heard >= WITHOUT_SIGHT

    def end(self) -> Connection | None:
        """Have nobody get it; return who is disappointed by that."""
        who = self.successor or self.asker
        self.asker = self.successor = None
        return who

    def withdraw(self, connection: str) -> None:
        """Forget that this connection wanted it."""
        for who in (self.asker, self.successor):
            if who is not None and who.id == connection:
                self.end()


UNUSED = 120.0
"""Seconds after which a person's lease expires that was neither used nor renewed. A
page gives back sooner what it does not need; one that hangs does not, and others would
wait. Browsers let a page that nobody sees act once a minute."""


class Authority:
    """The lease of one machine, and who is to have it next.

    Args:
        robots: The robots that it is.
        conditions: What stands against its motion.
        motion: Writes to it.
        speeds: How fast it may go.
        epochs: The epochs to give to leases.
        halt: Has it stop, if it is driven or tested, for a reason in words.
        changed: Called when it went to other hands.

    """

    def __init__(
        self,
        robots: Aliases,
        conditions: MotionConditions,
        motion: Motion,
        speeds: Speeds,
        epochs: Epochs,
        halt: Callable[[str, float], None],
        changed: Callable[[float], None],
    ) -> None:
        self.lease: Lease | None = None
        self.handover = Handover()
        self.deadman = DeadMan()
        self._robots = robots
        self._conditions = conditions
        self._motion = motion
        self._speeds = speeds
        self._epochs = epochs
        self._halt = halt
        self._changed = changed
        self._used_at = float("-inf")

    def why_unavailable(self, now: float) -> str | None:
        """Return why nobody can take the machine now, in words."""
        successor = self.handover.successor
        if successor is not None and not self._conditions.stopped:
            name = successor.name or successor.id
            return f"control goes to {name} when the robot has stopped"
        return self._conditions.why_unavailable(now)

    def is_held_by(self, connection: str) -> bool:
        """Return whether this connection has the lease."""
        return self.lease is not None and self.lease.connection == connection

    def give(self, to: Connection, now: float) -> int:
        """Let somebody have the machine; nothing moves by that."""
        epoch = self._epochs.next()
        self.lease = Lease(to.id, to.name, epoch, to.program)
        self.deadman = DeadMan(needs_neutral=not to.program)
        self.renew(now)
        self._new_driver(to.cap, now)
        return epoch

    def _new_driver(self, cap: Cap, now: float) -> None:
        """Forget what held for the hands before."""
        self._speeds.page_cap = cap
        self._speeds.ages.clear()
        self._conditions.video.forget()
        self._changed(now)

    def renew(self, now: float) -> None:
        """Note that its driver does something with it, or says to need it still."""
        self._used_at = now

    def set_cap(self, cap: Cap) -> None:
        """Change what the page of the lease's holder asks for at most."""
        self._speeds.page_cap = cap

    def end(self, why: str | None, now: float) -> None:
        """Take the machine out of everybody's hands; it stops if it is driven.

        Args:
            why: What its driver, and who wanted it, are told, if it is not the
                driver's own doing.
            now: The time.

        """
        disappointed = self.handover.end()
        if disappointed is not None:
            self._robots.refuse(disappointed.id, "ask", why or "the robot is gone")
        self._end(why, now)

    def _end(self, why: str | None, now: float) -> None:
        lease = self.lease
        if lease is None:
            return
        self._halt(why or "control was released", now)
        self.lease = None
        self.deadman = DeadMan()
        self._new_driver(page_cap(), now)
        if why is not None:
            self._robots.refuse(lease.connection, "lease", why)

    def release(self, connection: str, now: float) -> None:
        """Give the machine back, or ask for it no longer."""
        self.handover.withdraw(connection)
        if not self.is_held_by(connection):
            return
        if self.handover.asker is not None:
            self.hand_over(self.handover.asker, now)
        else:
            self._end(None, now)

    def ask(self, who: Connection, now: float) -> None:
        """Ask the holder for the machine.

        Raises:
            Refusal: If it can be taken without asking, or not at all.

        """
        if reason := self.why_unavailable(now):
            raise Refusal(reason)
        if self.lease is None or self.lease.program:
            raise Refusal("no operator has control: take control")
        self.handover.ask(who, now)

    def deny(self, why: str) -> None:
        """Have the holder keep it."""
        asker = self.handover.end()
        assert asker is not None  # only then is there anything to deny
        self._robots.refuse(asker.id, "ask", why)

    def hand_over(self, successor: Connection, now: float) -> None:
        """Zero first; ``successor`` gets the machine when it stands (S5)."""
        self._end(f"control goes to {successor.name or successor.id}", now)
        if self._robots.drivable:
            self._motion.zero(now)
        self._robots.cancel_for_driving(
            now
        )  # what follows a goal does not come to stand
        self.handover.begin(successor, now)
        self._changed(now)

    def step(self, now: float) -> None:
        """Let time have its say about who has the machine, and who gets it."""
        handover = self.handover
        if self._expired(now):
            self.end(f"not used for {UNUSED:g} s", now)
        if handover.asker is not None and handover.left(now) == 0:
            self.hand_over(handover.asker, now)
        successor = handover.successor
        if successor is None:
            return
        if reason := self._conditions.why_unavailable(now):
            self.end(reason, now)
        elif handover.is_still(now):
            handover.end()
            self.give(successor, now)
        elif self._robots.drivable and not self._motion.stopping:
            self._motion.zero(now)

    def _expired(self, now: float) -> bool:
        """Return whether its driver has forgotten it.

        A program's lease stays: any person may take the machine from it. One that is
        asked for goes to who asks, in seconds.
        """
        lease = self.lease
        if lease is None or lease.program or self.handover.asker is not None:
            return False
        return now - self._used_at >= UNUSED
