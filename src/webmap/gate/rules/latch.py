"""The STOP of one machine, which stands until somebody resets it (S7). No I/O.

The file of it is common to all gates on a computer, of which one alone may have the
machine. A STOP that is said to another one is found there by the gate that has it.

It holds from the moment it is set. That it is acknowledged is another thing: that
waits until the disk has it, so that a STOP which was confirmed to anybody is there
again after whatever happens to this process or this computer.

Each press is a STOP of its own, also while an earlier one stands. A reset names the
press that a person saw, so it cannot end a newer one.
"""

import secrets

from webmap.gate.actions import Emit, KeepLatch
from webmap.gate.events import Key, LatchKept, Press
from webmap.gate.refusal import Refusal


def new_press(by: str) -> Press:
    """Return a press of STOP that is unlike every other one.

    Args:
        by: Who pressed STOP, for people.

    """
    return Press(by, secrets.token_hex(8))


class Latch:
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

    def is_news(self, press: Press | None) -> bool:
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

    def keep_again(self) -> None:
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

    def kept(self, event: LatchKept) -> None:
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
        self._emit(KeepLatch(self._key, self._number, self.press, ids))
