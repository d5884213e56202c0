"""Asking a bridge for its topics, before anything else is there."""

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from webmap.errors import BridgeClosed
from webmap.ros.calls import Calls
from webmap.ros.graph import Graph

AGAIN = 0.5
"""Seconds between two attempts to reach a bridge."""


async def ask_topics(
    url: str,
    *,
    wait: float,
    patience: float = 5.0,
    waiting: Callable[[str], object] = lambda _why: None,
) -> dict[str, str]:
    """Return the type of every topic behind a bridge.

    Args:
        url: The bridge's address.
        wait: How long to wait for a bridge that cannot be reached, in seconds.
        patience: The longest time for rosapi's answer, in seconds.
        waiting: Called once with the reason if there is something to wait for.

    Raises:
        BridgeClosed: If the bridge cannot be reached in that time.
        ServiceError: If it has no rosapi, or rosapi does not answer.

    """
    calls = Calls(url)

    async def call(
        service: str, args: Mapping[str, Any] | Sequence[Any] | None = None
    ) -> Any:
        return await calls.call(service, args, None, patience)

    deadline = time.monotonic() + wait
    said = False
    try:
        while True:
            try:
                return await Graph(call).topics()
            except BridgeClosed as error:
                if time.monotonic() >= deadline:
                    raise
                if not said:
                    waiting(error.why or str(error))
                    said = True
            await asyncio.sleep(AGAIN)
    finally:
        await calls.stop()
