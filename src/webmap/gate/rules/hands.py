"""In whose hands one machine is, and how it goes from one to another. No I/O."""

from collections.abc import Callable

from webmap.gate.limits import Cap, page_cap
from webmap.gate.refusal import Refusal
from webmap.gate.rules.arming import Arming
from webmap.gate.rules.connection import Connection
from webmap.gate.rules.deadman import DeadMan
from webmap.gate.rules.handover import HandOver
from webmap.gate.rules.lease import Epochs, Lease
from webmap.gate.rules.motion import Motion
from webmap.gate.rules.robots import Robots
from webmap.gate.rules.speeds import Speeds

UNUSED = 120.0
"""Seconds after which a person's lease expires that was neither used nor renewed. A
page gives back sooner what it does not need; one that hangs does not, and others would
wait. Browsers let a page that nobody sees act once a minute."""


class Hands:
    """The lease of one machine, and who is to have it next.

    Args:
        robots: The robots that it is.
        arming: What stands against its motion.
        motion: Writes to it.
        speeds: How fast it may go.
        epochs: The epochs to give to leases.
        halt: Has it stop, if it is driven or tested, for a reason in words.
        changed: Called when it went to other hands.

    """

    def __init__(
        self,
        robots: Robots,
        arming: Arming,
        motion: Motion,
        speeds: Speeds,
        epochs: Epochs,
        halt: Callable[[str, float], None],
        changed: Callable[[float], None],
    ) -> None:
        self.lease: Lease | None = None
        self.handover = HandOver()
        self.deadman = DeadMan()
        self._robots = robots
        self._arming = arming
        self._motion = motion
        self._speeds = speeds
        self._epochs = epochs
        self._halt = halt
        self._changed = changed
        self._used_at = float("-inf")

    def unarmable(self, now: float) -> str | None:
        """Return why nobody can take the machine now, in words."""
        heir = self.handover.heir
        if heir is not None and not self._arming.stopped:
            return f"control goes to {heir.name or heir.id} when the robot has stopped"
        return self._arming.obstacle(now)

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
        self._arming.video.forget()
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
        if reason := self.unarmable(now):
            raise Refusal(reason)
        if self.lease is None or self.lease.program:
            raise Refusal("no operator has control: take control")
        self.handover.ask(who, now)

    def deny(self, why: str) -> None:
        """Have the holder keep it."""
        asker = self.handover.end()
        assert asker is not None  # only then is there anything to deny
        self._robots.refuse(asker.id, "ask", why)

    def hand_over(self, heir: Connection, now: float) -> None:
        """Zero first; ``heir`` gets the machine when it stands (S5)."""
        self._end(f"control goes to {heir.name or heir.id}", now)
        if self._robots.drivable:
            self._motion.zero(now)
        self._robots.make_way(now)  # what follows a goal does not come to stand
        self.handover.begin(heir, now)
        self._changed(now)

    def step(self, now: float) -> None:
        """Let time have its say about who has the machine, and who gets it."""
        handover = self.handover
        if self._expired(now):
            self.end(f"not used for {UNUSED:g} s", now)
        if handover.asker is not None and handover.left(now) == 0:
            self.hand_over(handover.asker, now)
        heir = handover.heir
        if heir is None:
            return
        if reason := self._arming.obstacle(now):
            self.end(reason, now)
        elif handover.stands(now):
            handover.end()
            self.give(heir, now)
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
