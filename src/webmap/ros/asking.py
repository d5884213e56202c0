"""Get the topics of a bridge before the display is built."""

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
