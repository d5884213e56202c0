"""Browser halves: the part of a module that reacts faster than a round trip."""

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

from webmap.core.page import Page

_numbers = itertools.count(1)


class BrowserHalf:
    """An ES module in one viewer's page that belongs to one module of one map."""

    def __init__(
        self,
        page: Page,
        map_element: int,
        module: Any,
        script: str | Path,
        options: dict[str, Any],
        style: str | Path | None,
        ended: Callable[[int], object],
    ) -> None:
        self.instance = next(_numbers)
        self.module = module
        self._channel = page.channel
        self._ended: Callable[[int], object] | None = ended
        self._channel.attach(
            map_element,
            self.instance,
            page.asset(script),
            options,
            None if style is None else page.asset(style),
        )

    def send(self, message: dict[str, Any]) -> None:
        """Send a message to the half; nothing happens once it has ended."""
        if self._ended is not None:
            self._channel.send(self.instance, message)

    def remove(self) -> None:
        """End the half; the second call does nothing."""
        ended, self._ended = self._ended, None
        if ended is not None:
            ended(self.instance)
            self._channel.detach(self.instance)
