"""How much each user of a router may send per second, and who receives it."""

import asyncio
import logging
import threading
import time
from collections.abc import Callable

from webmap.agents.address import Sender, sender_of
from webmap.base.errors import BridgeError, WireError
from webmap.gate.lanes.budget import Budget

log = logging.getLogger("webmap.agent")

BURST = 10.0
"""Seconds of the rates that may come at once: a display subscribes to all at once."""

QUIET = 10.0
"""Seconds for which the same user is not logged again."""

MOST_USERS = 1000
"""Users that are remembered; only a router without users has so many names."""


class UserRateLimit:
    """Limits what each user of a router may send; may be used in several threads.

    Args:
        what: What they send, for the log.
        pieces: Pieces per second. The default is for the displays of one user.
        size: Bytes per second.

    """

    def __init__(self, what: str, pieces: int = 400, size: int = 1 << 20) -> None:
        self._what, self._pieces, self._size = what, pieces, size
        self._budgets: dict[str, Budget] = {}
        self._logged: dict[str, float] = {}
        self._lock = threading.Lock()

    def admits(self, user: str, size: int, now: float) -> bool:
        """Return whether a piece of so many bytes is used; it counts only then."""
        with self._lock:
            if len(self._budgets) >= MOST_USERS:
                self._budgets.clear()
                self._logged.clear()
            budget = self._budgets.get(user)
            if budget is None:
                budget = Budget(self._pieces, self._size, BURST)
                self._budgets[user] = budget
            admitted = not budget.wait(now)
            if admitted:
                budget.spend(1, size, 0.0, now)
            elif now - self._logged.get(user, -QUIET) >= QUIET:
                self._logged[user] = now
                log.warning("%s sends too many %s: some are lost", user, self._what)
            return admitted


class Receiver:
    """Passes messages of displays to the event loop, within the limit of each user.

    Args:
        what: What displays send, for the log.
        process: Called in the loop with the sender, the message and the time. An error
            about the message is logged.

    """

    def __init__(
        self, what: str, process: Callable[[Sender, bytes, float], None]
    ) -> None:
        self._limit = UserRateLimit(what)
        self._process = process
        self._loop: asyncio.AbstractEventLoop | None = None

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Set the loop; messages that come before are dropped."""
        self._loop = loop

    def receive(self, key: str, piece: bytes) -> None:
        """Take a message with the key that it came under; called in any thread."""
        sender, loop = sender_of(key), self._loop
        if loop is None or loop.is_closed():
            return
        if self._limit.admits(sender.user, len(piece), time.monotonic()):
            loop.call_soon_threadsafe(self._pass_on, sender, piece)

    def _pass_on(self, sender: Sender, piece: bytes) -> None:
        try:
            self._process(sender, piece, time.monotonic())
        except (WireError, BridgeError) as error:
            log.warning("display %s: %s", sender.display, error)
