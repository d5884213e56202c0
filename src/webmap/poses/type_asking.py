"""Asking a bridge for the type of a topic until it is known."""

import asyncio
import time
from collections.abc import Callable

from webmap.base.scope import Removable
from webmap.base.tasks import spawn
from webmap.ros.bridge import Bridge

SOON, LATER = 2.0, 5.0
"""Seconds between two questions: the first few, and from then on."""

FEW = 5
"""How many questions follow one another soon."""

SHARE = 10
"""By what the time that an answer took is multiplied to the shortest pause after it,
so that a bridge that hangs is asked rarely."""


class TypeAsking:
    """Asks for the type of a topic whenever the link opens, and on while it is unknown.

    The node that has the topic may start after the link is open, and so may the one
    that answers the question.

    Args:
        bridge: The link.
        topic: The topic.
        found: Called with each type that was told, in the bridge's dialect.
        unknown: Called each time that nobody knows it, if given.

    """

    def __init__(
        self,
        bridge: Bridge,
        topic: str,
        found: Callable[[str], object],
        unknown: Callable[[], object] | None = None,
    ) -> None:
        self._bridge = bridge
        self._topic = topic
        self._found = found
        self._unknown = unknown
        self._known = False
        self._over = False
        self._turn = 0
        self._timer: asyncio.TimerHandle | None = None
        self._opening: Removable = bridge.on_open(self._begin)

    def remove(self) -> None:
        """Ask no more; the second call does nothing."""
        self._over = True
        self._opening.remove()
        self._drop()

    def _begin(self) -> None:
        self._drop()
        if not self._over:
            spawn(self._ask(self._turn, 1))

    def _drop(self) -> None:
        """Let an answer that is under way count no more, nor a question follow it."""
        self._turn += 1
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    async def _ask(self, turn: int, number: int) -> None:
        began = time.monotonic()
        type = await self._bridge.topic_type(self._topic)
        if turn != self._turn:
            return
        if type is not None:
            self._known = True
            self._found(type)
            return
        if self._unknown is not None:
            self._unknown()
        if not self._known:  # what was told before the link was lost still holds
            took = time.monotonic() - began
            pause = max(SOON if number <= FEW else LATER, SHARE * took)
            # No task waits meanwhile: nothing is left over when the process ends.
            loop = asyncio.get_running_loop()
            self._timer = loop.call_later(pause, self._again, turn, number + 1)

    def _again(self, turn: int, number: int) -> None:
        if turn == self._turn and self._bridge.state == "open":
            spawn(self._ask(turn, number))
