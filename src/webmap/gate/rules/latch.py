"""The STOP of one machine, which stands until somebody resets it (S7). No I/O.

The file of it is common to all gates on a computer, of which one alone may have the
machine. A STOP that is said to another one is found there by the gate that has it.

It holds from the moment it is set. That it is acknowledged is another thing: that
waits until the disk has it, so that a STOP which was confirmed to anybody is there
again after whatever happens to this process or this computer.
"""

from webmap.gate.actions import Emit, KeepLatch
from webmap.gate.events import Key, LatchKept


class Latch:
    """Whether STOP stands for one machine, and whether the disk knows.

    Args:
        key: The machine.
        emit: Takes the actions.

    """

    def __init__(self, key: Key, emit: Emit) -> None:
        self.by: str | None = None
        """Who said STOP, for people; ``None`` if it does not stand."""
        self.trouble: str | None = None
        """Why the disk does not have it, in words."""
        self._key = key
        self._emit = emit
        self._number = 0
        self._kept = True

    @property
    def on(self) -> bool:
        """Whether STOP stands."""
        return self.by is not None

    @property
    def acknowledged(self) -> bool:
        """Whether STOP stands and everything was done that it will stand."""
        return self.on and self._kept

    def set(self, by: str) -> None:
        """Have STOP stand from now on; pressed again, it stays whose it is."""
        if not self.on or self.trouble is not None:
            self.by = by
            self._keep()

    def found(self, by: str) -> None:
        """Take over what an earlier gate left on disk, or another one put there."""
        self.by = by

    @property
    def settled(self) -> bool:
        """Whether the disk has what holds here, as far as it can."""
        return self._kept

    def keep_again(self) -> None:
        """Keep what holds: somebody took the file away."""
        self._keep()

    def drop(self) -> None:
        """Let STOP stand no longer here; what is on disk is another gate's matter."""
        self.by = None

    def reset(self) -> None:
        """Let STOP stand no longer."""
        self.by = None
        self._keep()

    def kept(self, event: LatchKept) -> None:
        """Note what became of keeping it; only the newest state counts."""
        if event.number == self._number:
            self._kept, self.trouble = True, event.error

    def _keep(self) -> None:
        self._number += 1
        self._kept, self.trouble = False, None
        self._emit(KeepLatch(self._key, self._number, self.by))
