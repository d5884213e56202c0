"""The line of the page that says that it shows a recording."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import msgspec

if TYPE_CHECKING:
    from webmap import Bridge, Map


class _String(msgspec.Struct):
    data: str


class RecordingLine:
    """Says beside the product's name what is played, and where in it; a map module.

    Args:
        map: The map.
        bridge: The bridge to the replay.
        topic: Where the replay says it, in words.
        opened: Called when a page is there.

    """

    def __init__(
        self, map: "Map", bridge: "Bridge", topic: str, opened: Callable[[], object]
    ) -> None:
        self._title = map.page.element("title")
        bridge.subscribe(topic, self._show, "std_msgs/String", decode=_String)
        opened()

    def _show(self, message: _String) -> None:
        self._title.text = message.data
