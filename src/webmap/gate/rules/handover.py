"""Who asks for a machine, and whose it will be once it stands (S5). No I/O.

::

    asked ── granted, or 10 s without an answer, or the holder let go ──▶ changing
      │                                                                     │
      └─ denied, withdrawn, STOP ──▶ nobody                standstill ──────┴──▶ given

While it changes hands nobody has it, and zero is all that is written.
"""

from webmap.base.geometry import Twist
from webmap.gate.refusal import Refusal
from webmap.gate.rules.connection import Connection
from webmap.gate.rules.standstill import Standstill

ASKING = 10.0
"""Seconds after which a holder who does not answer has granted it."""

WITHOUT_SIGHT = 1.0
"""Seconds after zero that are taken for standstill where no odometry tells."""


class HandOver:
    """The way of one machine from one pair of hands to another."""

    def __init__(self) -> None:
        self.asker: Connection | None = None
        self.heir: Connection | None = None
        """Who gets it as soon as it stands."""
        self._asked_at = float("-inf")
        self.since = float("-inf")
        """When zero was written to have it stand."""
        self._still = Standstill()

    @property
    def going_on(self) -> bool:
        """Whether time may make a difference."""
        return self.asker is not None or self.heir is not None

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

    def begin(self, heir: Connection, now: float) -> None:
        """Wait for standstill, zero having been written at ``now``."""
        self.asker, self.heir, self.since = None, heir, now
        self._still.begin()

    def saw(self, twist: Twist | None, now: float) -> None:
        """Take in a message of odometry."""
        self._still.saw(twist, now)

    def stands(self, now: float) -> bool:
        """Return whether it is standing, as far as anybody can tell."""
        if self._still.reached:
            return True
        heard = max(self.since, self._still.heard_at)
        return now - heard >= WITHOUT_SIGHT

    def end(self) -> Connection | None:
        """Have nobody get it; return who is disappointed by that."""
        who = self.heir or self.asker
        self.asker = self.heir = None
        return who

    def withdraw(self, connection: str) -> None:
        """Forget that this connection wanted it."""
        for who in (self.asker, self.heir):
            if who is not None and who.id == connection:
                self.end()
