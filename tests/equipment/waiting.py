"""Wait until something is true.

The patience is a number of polls with a short pause after each, not a time: a test that
gets little of the processor polls less often, so it waits longer.
"""

import asyncio
import time
from collections.abc import Callable, Iterator
from typing import TypeVar

from playwright.sync_api import Page

Found = TypeVar("Found")

PAUSE = 0.01
"""Seconds of sleep after each poll."""


def wait_for(
    check: Callable[[], Found],
    what: str | Callable[[], str] = "the condition",
    seconds: float = 20.0,
    page: Page | None = None,
) -> Found:
    """Wait until ``check`` returns a true value, and return the value.

    Args:
        check: Is called in each poll.
        what: What is waited for; a function can add the present state.
        seconds: The patience on a machine that is not busy.
        page: A page whose events must be handled meanwhile.

    Raises:
        AssertionError: The value was not true in any poll.

    """
    for _ in polls(what, seconds):
        if found := check():
            return found
        if page is None:
            time.sleep(PAUSE)
        else:
            page.wait_for_timeout(1000 * PAUSE)


async def until(
    check: Callable[[], Found],
    what: str | Callable[[], str] = "the condition",
    seconds: float = 20.0,
) -> Found:
    """Wait as ``wait_for`` does, while the other tasks of the event loop run."""
    for _ in polls(what, seconds):
        if found := check():
            return found
        await asyncio.sleep(PAUSE)


def polls(
    what: str | Callable[[], str], seconds: float = 20.0, pause: float = PAUSE
) -> Iterator[None]:
    """Yield before each poll, for loops that do more than to check.

    Args:
        what: What is waited for.
        seconds: The patience on a machine that is not busy.
        pause: Seconds for which the loop sleeps after each poll.

    Raises:
        AssertionError: There were as many polls as ``seconds`` have pauses.

    """
    begun, most = time.monotonic(), max(round(seconds / pause), 1)
    for _ in range(most):
        yield
    waited = time.monotonic() - begun
    name = what if isinstance(what, str) else what()
    raise AssertionError(
        f"timed out waiting for {name}: {most} polls in {waited:.1f} s"
    )
