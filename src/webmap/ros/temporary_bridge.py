"""A bridge for a short time, such as to get its topics before the display is built."""

import asyncio
import time
from collections.abc import Callable
from typing import Self

from webmap.base.errors import BridgeClosed
from webmap.base.scope import no_scope
from webmap.ros.bridge import Bridge

AGAIN = 0.5
"""Seconds between two attempts to reach a bridge."""


class TemporaryBridge(Bridge):
    """A bridge for the duration of an ``async with``, such as to examine a robot.

    WebMap's life cycle does not start it.
    """

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *exception: object) -> None:
        await self.stop()

    async def open(self) -> None:
        """Open the connection for messages; service calls open another one.

        Raises:
            BridgeClosed: If the connection cannot be opened.

        """
        loop = asyncio.get_running_loop()
        opened: asyncio.Future[None] = loop.create_future()

        def failed(error: Exception) -> None:
            if not opened.done():
                opened.set_exception(error)

        def succeeded() -> None:
            if not opened.done():
                opened.set_result(None)

        with no_scope():
            removals = (self.on_open(succeeded), self.on_error(failed))
        self.start(loop)
        try:
            await opened
        finally:
            for removal in removals:
                removal.remove()

    def _enlist(self) -> None:
        pass


async def ask_topics(
    url: str,
    *,
    wait: float,
    waiting: Callable[[str], object] = lambda _why: None,
) -> dict[str, str]:
    """Return the topics of a bridge and the type of each.

    Args:
        url: The address of the bridge.
        wait: Longest time to wait for an unreachable bridge, in seconds.
        waiting: Called once with the reason when waiting begins.

    Raises:
        BridgeClosed: If the bridge cannot be reached in that time.
        ServiceError: If the bridge does not list its topics.

    """
    deadline = time.monotonic() + wait
    reported = False
    async with TemporaryBridge(url) as bridge:
        while True:
            try:
                return await bridge.topics()
            except BridgeClosed as error:
                if time.monotonic() >= deadline:
                    raise
                if not reported:
                    waiting(error.why or str(error))
                    reported = True
            await asyncio.sleep(AGAIN)
