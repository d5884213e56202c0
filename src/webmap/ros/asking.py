"""Asking a bridge for its topics, before anything else is there."""

import asyncio
import time
from collections.abc import Callable

from webmap.base.errors import BridgeClosed
from webmap.ros.bridge import TemporaryBridge

AGAIN = 0.5
"""Seconds between two attempts to reach a bridge."""


async def ask_topics(
    url: str,
    *,
    wait: float,
    waiting: Callable[[str], object] = lambda _why: None,
) -> dict[str, str]:
    """Return the type of every topic behind a bridge.

    Args:
        url: The bridge's address.
        wait: How long to wait for a bridge that cannot be reached, in seconds.
        waiting: Called once with the reason if there is something to wait for.

    Raises:
        BridgeClosed: If the bridge cannot be reached in that time.
        ServiceError: If it does not list its topics.

    """
    deadline = time.monotonic() + wait
    said = False
    async with TemporaryBridge(url) as bridge:
        while True:
            try:
                return await bridge.topics()
            except BridgeClosed as error:
                if time.monotonic() >= deadline:
                    raise
                if not said:
                    waiting(error.why or str(error))
                    said = True
            await asyncio.sleep(AGAIN)
