"""Looking again and again which topics are behind a bridge."""

import asyncio
import contextlib
import logging
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING

from webmap.cli.echo import echo
from webmap.errors import BridgeError
from webmap.lifecycle import lifecycle
from webmap.logs import budgets

if TYPE_CHECKING:
    from webmap import Bridge

log = logging.getLogger("webmap.cli")

LONGEST = 60.0
"""Seconds between two looks at a rosapi that does not answer: each costs a call."""


class Looking(ABC):
    """Takes the topics behind a bridge now and then; a service of the process.

    Args:
        bridge: The bridge.
        topics: Types by topic, where the bridge cannot be asked for them.

    """

    def __init__(
        self, bridge: "Bridge", topics: Mapping[str, str] | None = None
    ) -> None:
        self.bridge = bridge
        self._told_topics = topics
        self._task: asyncio.Task[None] | None = None
        lifecycle.add(self)

    @property
    @abstractmethod
    def period(self) -> float:
        """Seconds between two looks from now on."""

    @abstractmethod
    async def take(self, topics: dict[str, str]) -> None:
        """Make something of the types by topic."""

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to look."""
        self._task = loop.create_task(self._look_on())

    async def stop(self) -> None:
        """Look no more."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])

    async def _look_on(self) -> None:
        pause = self.period
        while True:
            if self.bridge.state != "open":
                pause = self.period
            else:
                try:
                    await self.take(await self._topics())
                    pause = self.period
                except BridgeError as error:
                    log.debug("%s: %s", self.bridge.url, error)
                    pause = min(2 * pause, LONGEST)
                except Exception:
                    log.exception("%s: a look at the topics failed", self.bridge.url)
                    pause = min(2 * pause, LONGEST)
            await asyncio.sleep(pause)

    async def _topics(self) -> dict[str, str]:
        if self._told_topics is not None:
            return dict(self._told_topics)
        return await self.bridge.topics()


def say(text: str) -> None:
    """Print a line on standard error; that nobody reads it is no reason to stop.

    Robots that appear cause such lines, so there is a limit as for a log.
    """
    added = budgets.note(("say",), "")
    if added is None:
        return
    with contextlib.suppress(OSError, ValueError):  # a full disk, nobody at the pipe
        echo(f"{text}{added}", err=True)
