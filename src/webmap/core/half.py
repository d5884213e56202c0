"""Browser halves: the part of a module that reacts faster than a round trip."""

import itertools
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from webmap.core.world_view import WorldView

_numbers = itertools.count(1)


class BrowserHalf:
    """An ES module in one viewer's page that belongs to one module of one map."""

    def __init__(
        self,
        map: "WorldView",
        module: Any,
        script: str | Path,
        options: dict[str, Any],
        style: str | Path | None,
    ) -> None:
        self.instance = next(_numbers)
        self.module = module
        self._map: WorldView | None = map
        page = map.page
        page.channel.attach(
            map.root.id,
            self.instance,
            page.asset(script),
            options,
            None if style is None else page.asset(style),
        )

    def send(self, message: dict[str, Any]) -> None:
        """Send a message to the half; nothing happens once it has ended."""
        if self._map is not None:
            self._map.page.channel.send(self.instance, message)

    def remove(self) -> None:
        """End the half; the second call does nothing."""
        map, self._map = self._map, None
        if map is not None:
            map.forget_half(self)
            map.page.channel.detach(self.instance)
