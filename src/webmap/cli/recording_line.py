"""The line of the page that says that it shows a recording."""

import math
import re
from collections.abc import Callable
from typing import TYPE_CHECKING

import msgspec

if TYPE_CHECKING:
    from webmap import Bridge, Map


POSITION = re.compile(r".*: (\d+\.\d) of ")
"""Where in the recording the replay is, in seconds."""


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
        self._map = map
        self._at = math.inf  # it begins anew when the first page opens
        self._title = map.page.element("title")
        bridge.subscribe(topic, self._show, "std_msgs/String", decode=_String)
        opened()

    def _show(self, message: _String) -> None:
        self._title.text = message.data
        found = POSITION.match(message.data)
        if found is None:
            return
        before, self._at = self._at, float(found[1])
        if self._at < before:  # a new round: robots are where they were at its begin
            for robot in self._map.robots:
                robot.expect_jump()
