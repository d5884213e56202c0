"""Measures distances on the map."""

from webmap.core.map import Map
from webmap.core.registry import map_modules


@map_modules.register
class MeasureTool:
    """Measures on the map: press at the beginning, drag, release.

    The tool begins with its button or its key; Escape ends it. Only the page that
    measures shows the line, its length in metres and its direction in degrees,
    counter-clockwise from x.

    Args:
        map: The map.
        key: The key that begins the tool.

    Raises:
        ValueError: If ``key`` is not one character.
    """

    def __init__(self, map: Map, *, key: str = "m") -> None:
        if len(key) != 1:
            raise ValueError(f"MeasureTool: key must be one character, got {key!r}")
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/measure/measure_tool.js",
            {"key": key},
            "features/measure/measure_tool.css",
        )
