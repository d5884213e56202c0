"""Control of one machine: its holder, and how the holder changes. No I/O.

::

    requested ── granted, no answer for 10 s, or released ──▶ changing
      │                                                          │
      └─ denied, withdrawn, STOP ──▶ request ends   standstill ──┴──▶ given

While control changes, there is no holder, and the gate writes only zeros.
"""

from collections.abc import Callable
from dataclasses import replace

from webmap.base.geometry import Twist
from webmap.gate.commands import Refusal
from webmap.gate.events import Key, LockState
from webmap.gate.rules.aliases import Aliases
from webmap.gate.rules.connections import Connection, Epochs, Lease
from webmap.gate.rules.delivery import Delivery, without_proof
from webmap.gate.rules.health import (
    DisplayPulse,
    Observation,
    Standstill,
    Video,
)
from webmap.gate.rules.motion import DeadMan, Motion
from webmap.gate.rules.speeds import MachineSpeeds
from webmap.gate.rules.stop import StopLatch
from webmap.gate.specs import Cap, page_cap
from webmap.ros.names import is_foxglove_url

NO_TIMEOUT = (
    "behind Foxglove a robot is driven only if its base stops by itself: state "
    "stops_within, or run the stop test"
)
"""Why a robot is not driven whose command timeout is not known."""


class MotionConditions:
    """The conditions for motion that do not depend on the operator.

    Args:
        key: The machine.
        robots: The robots of the machine.
        latch: The machine's STOP.
        control: Whether its velocities arrive.
        speeds: What is known of its speed and its command timeout.
        pulse: Whether the display is alive.
        observation: The newest odometry and echo of the machine.

    """

    def __init__(
        self,
        key: Key,
        robots: Aliases,
        latch: StopLatch,
        control: Delivery,
        speeds: MachineSpeeds,
        pulse: DisplayPulse,
        observation: Observation,
    ) -> None:
        self.lock = LockState(key, held=False)
        """Whether this gate alone on this computer has the machine."""
        self.video = Video()
        self._url = key.url
        self._robots = robots
        self._latch = latch
        self._control = control
        self._speeds = speeds
        self._display_pulse = pulse
        self._observation = observation

    @property
    def stopped(self) -> bool:
        """Whether STOP is active."""
        return self._latch.on

    def why_unavailable(self, now: float) -> str | None:
        """Return why nothing can have control now, as text for people, or ``None``."""
        if self._latch.on:
            return f"STOP by {self._latch.by} is active: reset it first"
        if not self.lock.held:
            return self.lock.why
        if fault := self._display_pulse.fault(now):
            return fault
        if self._robots.drivable:
            if not self._control.up:
                return f"no connection to {self._url}"
            if self._control.only_echoes and not self._robots.drive_without_proof:
                return without_proof(self._url)
            return None
        goals = self._robots.goals[self._robots.newest.id]
        if goals.spec.move is None:
            return "the robot has no velocity topic and no goal topic"
        return goals.why_not

    def why_blocked(self, now: float) -> str | None:
        """Return why the machine must not be driven now, or ``None``."""
        if reason := self.why_unavailable(now):
            return reason
        if not self._robots.drivable:
            return "the robot has no velocity topic"
        if fault := self._control.fault(now):
            return fault
        if self._robots.has_odometry and (fault := self._observation.fault(now)):
            return fault
        return self.video.fault(now)

    def why_not_driven(self, now: float) -> str | None:
        """Return why the machine must not be driven, except in a stop test.

        Behind a bridge of Foxglove, a call of any client may hold back all zeros.
        """
        if reason := self.why_blocked(now):
            return reason
        if is_foxglove_url(self._url) and self._speeds.stop_time is None:
            return NO_TIMEOUT
        return None

    @property
    def needs_echo(self) -> bool:
        """Whether zeros must show first that velocities come back."""
        return self._control.needs_echo


REQUEST_TIMEOUT = 10.0
"""Seconds without an answer of the holder after which a request is granted."""

ASSUMED_STANDSTILL = 1.0
"""Seconds after a zero when standstill is assumed if there is no odometry."""


class Handover:
    """The change of control of one machine from its holder to a successor."""

    def __init__(self) -> None:
        self.asker: Connection | None = None
        self.successor: Connection | None = None
        """The connection that gets control when the machine has stopped."""
        self._asked_at = float("-inf")
        self.since = float("-inf")
        """When zero was written to stop the machine."""
        self._still = Standstill()

    @property
    def going_on(self) -> bool:
        """Whether a request or a change of control is pending."""
        return self.asker is not None or self.successor is not None

    def ask(self, who: Connection, now: float) -> None:
        """Request control; a second request of the same connection changes nothing.

        Raises:
            Refusal: If another connection has already requested control.

        """
        if self.asker is None:
            self.asker, self._asked_at = who, now
        elif self.asker is not who:
            raise Refusal(f"{self.asker.called} has already requested control")

    def left(self, now: float) -> float:
        """Return the seconds until the request is granted without an answer."""
        return max(0.0, self._asked_at + REQUEST_TIMEOUT - now)

    def begin(self, successor: Connection, now: float) -> None:
        """Begin to wait for standstill; zero was written at ``now``."""
        self.asker, self.successor, self.since = None, successor, now
        self._still.begin()

    def observe(self, twist: Twist | None, now: float) -> None:
        """Take a message of odometry into account."""
        self._still.observe(twist, now)

    def is_still(self, now: float) -> bool:
        """Return whether the machine has stopped, by odometry or by time.

        Without odometry for ``ASSUMED_STANDSTILL`` seconds, time decides.
        """
        if self._still.reached:
            return True
        last = max(self.since, self._still.heard_at)
        return now - last >= ASSUMED_STANDSTILL

    def end(self) -> Connection | None:
        """End the request or the change; return the connection that gets nothing."""
        who = self.successor or self.asker
        self.asker = self.successor = None
        return who

    def withdraw(self, connection: str) -> None:
        """End the request of a connection, or the handover to it, if it has one."""
        for who in (self.asker, self.successor):
            if who is not None and who.id == connection:
                self.end()


UNUSED = 120.0
"""Seconds after which an operator's lease expires if it was neither used nor renewed.

A page releases control earlier when it no longer needs it. A page that hangs does not,
and others would wait. Browsers let a hidden page run code only once a minute.
"""


class Authority:
    """The lease of one machine, and who gets the next one.

    Args:
        robots: The robots of the machine.
        conditions: The conditions for its motion.
        motion: Writes its velocities.
        speeds: Its speed limits.
        epochs: Gives the epochs of leases.
        halt: Stops the machine if it is driven or tested; called with the reason.
        changed: Called when the holder has changed.

    """

    def __init__(
        self,
        robots: Aliases,
        conditions: MotionConditions,
        motion: Motion,
        speeds: MachineSpeeds,
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
        """Return why control cannot be taken now, as text for people, or ``None``."""
        successor = self.handover.successor
        if successor is not None and not self._conditions.stopped:
            return (
                f"control is being handed over to {successor.called}; "
                "the robot stops first"
            )
        return self._conditions.why_unavailable(now)

    def is_held_by(self, connection: str) -> bool:
        """Return whether this connection has the lease."""
        return self.lease is not None and self.lease.connection == connection

    def involves(self, connection: str) -> bool:
        """Return whether this connection has the lease, or waits for it."""
        waiting = (self.handover.asker, self.handover.successor)
        return self.is_held_by(connection) or any(
            who is not None and who.id == connection for who in waiting
        )

    def give(self, to: Connection, now: float) -> int:
        """Give the lease to a connection and return its epoch; nothing moves."""
        epoch = self._epochs.next()
        self.lease = Lease(to.id, to.name, epoch, to.program, to.identity)
        self.deadman = DeadMan(needs_neutral=not to.program)
        self.renew(now)
        self._new_driver(to.cap, now)
        if self._robots.drivable and self._conditions.needs_echo:
            self._motion.zero(now)
        return epoch

    def rename(self, who: Connection) -> None:
        """Take over the new name of a connection, if it has the lease."""
        if self.lease is not None and self.lease.connection == who.id:
            self.lease = replace(self.lease, name=who.name)

    def _new_driver(self, cap: Cap, now: float) -> None:
        """Reset everything that belonged to the previous holder."""
        self._speeds.page_cap = cap
        self._speeds.ages.clear()
        self._conditions.video.forget()
        self._changed(now)

    def renew(self, now: float) -> None:
        """Note that the holder uses control or renews the lease."""
        self._used_at = now

    def set_cap(self, cap: Cap) -> None:
        """Set the speed limit that the holder's page asks for."""
        self._speeds.page_cap = cap

    def end(self, why: str | None, now: float) -> None:
        """End the lease and any request; the machine stops if it is driven.

        Args:
            why: The reason, sent to the holder and to the connection that requested
                control; ``None`` if the holder itself ends the lease.
            now: Seconds, monotonic.

        """
        waiting = self.handover.end()
        if waiting is not None:
            self._robots.refuse(waiting.id, "ask", why or "the robot is gone")
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
        """Release control, or withdraw a request."""
        self.handover.withdraw(connection)
        if not self.is_held_by(connection):
            return
        if self.handover.asker is not None:
            self.hand_over(self.handover.asker, now)
        else:
            self._end(None, now)

    def ask(self, who: Connection, now: float) -> None:
        """Request control from the holder.

        Raises:
            Refusal: If control can be taken without a request, or not at all.

        """
        if reason := self.why_unavailable(now):
            raise Refusal(reason)
        if self.lease is None or self.lease.program:
            raise Refusal("no operator has control: take control")
        self.handover.ask(who, now)

    def deny(self, why: str) -> None:
        """Deny the request: the holder keeps control."""
        asker = self.handover.end()
        assert asker is not None  # the caller has checked that there is a request
        self._robots.refuse(asker.id, "ask", why)

    def hand_over(self, successor: Connection, now: float) -> None:
        """Write zero; ``successor`` gets control when the machine has stopped (S5)."""
        self._end(f"control is handed over to {successor.called}", now)
        if self._robots.drivable:
            self._motion.zero(now)
        # A robot that follows a goal would not stop.
        self._robots.cancel_for_driving(now)
        self.handover.begin(successor, now)
        self._changed(now)

    def step(self, now: float) -> None:
        """Do what is due: expire the lease, grant a request, give control."""
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
        """Return whether the lease has expired because it was not used.

        A program's lease does not expire: any operator may take control from it. A
        lease that is requested goes to the other operator within seconds anyway.
        """
        lease = self.lease
        if lease is None or lease.program or self.handover.asker is not None:
            return False
        return now - self._used_at >= UNUSED
