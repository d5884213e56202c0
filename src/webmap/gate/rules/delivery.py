"""Whether the velocities of one machine arrive. No I/O.

Most bridges handle the messages of a connection in order, and answer a ping after what
was written before it. Then the answer proves that this was handled.

Others handle the messages of all clients in one thread and answer pings in another
(foxglove_bridge up to 0.8.5). While a service call of any client blocks the first
thread, pings are still answered, and velocities wait. There an answered ping proves
that the connection works, and only an *echo* proves more: a velocity that the robot's
ROS sends back. Zeros of other programs look the same as an echo of a zero, so only
the echo of another velocity proves that it, and all before it, was handled.
"""

from collections import deque

from webmap.base.geometry import Twist
from webmap.gate.events import Key
from webmap.gate.rules.health import PROOF_LIMIT, STALL_LIMIT, LinkHealth


def without_proof(url: str) -> str:
    """Return why nothing is moved through such a bridge unless that is accepted."""
    return (
        f"{url} is an old foxglove_bridge (before 3.0): any of its clients can hold "
        "back every velocity without a limit, and WebMap cannot notice at once; set "
        "drive_without_proof to accept this danger"
    )


class Delivery:
    """Whether the velocities of one machine arrive, by answered pings and echoes.

    Args:
        key: The machine.
        link: The link that carries them.

    """

    def __init__(self, key: Key, link: LinkHealth) -> None:
        self._key = key
        self._link = link
        self._returned = False
        """Whether any velocity was received on this connection."""
        self._waiting: deque[tuple[float, Twist]] = deque()
        """The velocities without an echo yet, and when each was written."""

    @property
    def up(self) -> bool:
        """Whether the link is open."""
        return self._link.up

    @property
    def only_echoes(self) -> bool:
        """Whether only an echo proves that a velocity has arrived."""
        return self._link.only_echoes

    @property
    def needs_echo(self) -> bool:
        """Whether a zero is needed, to see whether velocities come back at all."""
        return self.up and self.only_echoes and not self._returned

    def opened(self) -> None:
        """Note a new connection.

        A bridge that answers pings in another thread greets clients there too, so
        velocities of earlier connections may still wait in the first thread.
        """
        self._returned = False
        if not self.only_echoes:
            self._waiting.clear()

    def on_written(self, twist: Twist, now: float) -> None:
        """Note a velocity that was written."""
        if self.only_echoes and not twist.is_zero:
            self._waiting.append((now, twist))

    def on_echo(self, twist: Twist, now: float) -> None:
        """Note a velocity received on the velocity topic, of whoever published it."""
        if not self.only_echoes:
            return
        if not self._returned:  # the thread has handled all before the subscription
            self._returned = True
            self._waiting.clear()
        for at, sent in self._waiting:
            if sent == twist:
                while self._waiting and self._waiting[0][0] <= at:
                    self._waiting.popleft()
                self._link.trips.add(now - at, now)
                return

    def fault(self, now: float) -> str | None:
        """Return why no velocity other than zero may be written now, or ``None``."""
        if not self._link.fresh(now):
            return f"no answer from {self._key.url}"
        if self.needs_echo:
            return (
                f"{self._key.url} has sent no velocity of {self._key.topic} back, so "
                "nothing shows that velocities arrive"
            )
        if self._late(now) > PROOF_LIMIT:
            return f"{self._key.url} handles nothing: velocities do not come back"
        return None

    def stalled(self, now: float) -> bool:
        """Return whether an echo is missing for so long that the link must be cut.

        It may also be lost; then the first velocity that the next connection receives
        shows that nothing waits. So that connection is not cut before.
        """
        return self.up and self._returned and self._late(now) > STALL_LIMIT

    def answered_since(self, then: float) -> bool:
        """Return whether what was written at ``then`` has arrived.

        Where only echoes prove it: whether the connection carried it, and no earlier
        velocity waits that could still move the machine.
        """
        return self._link.answered_since(then) and not self._waiting

    def _late(self, now: float) -> float:
        """Return for how long the oldest echo is missing, in seconds."""
        return now - self._waiting[0][0] if self._waiting else 0.0
