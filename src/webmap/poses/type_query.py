"""Queries of a bridge for the type of a topic until it is known."""

import asyncio
import time
from collections.abc import Callable

from webmap.base.scope import Removable
from webmap.base.tasks import spawn
from webmap.ros.bridge import Bridge

SOON, LATER = 2.0, 5.0
"""Seconds between two queries: for the first few, and after them."""

FEW = 5
"""How many queries use the shorter pause."""

SHARE = 10
"""The least pause after a query in multiples of its duration, so that a slow bridge is
queried rarely."""


class TypeQuery:
    """Queries the type of a topic whenever the connection opens, until it is known.

    The node that has the topic may start after the connection opened, and so may the
    node that answers the query.

    Args:
        bridge: The bridge to query.
        topic: The topic.
        found: Called with each type returned, as the bridge spells it.
        unknown: Called each time that the bridge does not know the type, if given.

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
        """Stop the queries; a second call does nothing."""
        self._over = True
        self._opening.remove()
        self._drop()

    def _begin(self) -> None:
        self._drop()
        if not self._over:
            spawn(self._ask(self._turn, 1))

    def _drop(self) -> None:
        """Ignore a pending answer, and cancel the next query."""
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
        if not self._known:  # a type from before the connection was lost stays valid
            took = time.monotonic() - began
            pause = max(SOON if number <= FEW else LATER, SHARE * took)
            # No task waits meanwhile, so none is left when the process ends.
            loop = asyncio.get_running_loop()
            self._timer = loop.call_later(pause, self._again, turn, number + 1)

    def _again(self, turn: int, number: int) -> None:
        if turn == self._turn and self._bridge.state == "open":
            spawn(self._ask(turn, number))
