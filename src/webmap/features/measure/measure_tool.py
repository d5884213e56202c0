"""How far it is from here to there, on the map."""

from typing import TYPE_CHECKING

from webmap.core.registry import map_modules

if TYPE_CHECKING:
    from webmap.core.map import Map


@map_modules.register
class MeasureTool:
    """Measures on the map: press where it begins, drag, release.

    It begins by its button or by its key; Escape leaves. Only the viewer's own page
    shows the line, its length in metres and its direction in degrees, counter-clockwise
    from x.

    Args:
        map: The map.
        key: The key that begins.

    Raises:
        ValueError: If ``key`` is not one character.

    """

    def __init__(self, map: "Map", *, key: str = "m") -> None:
        if len(key) != 1:
            raise ValueError(f"MeasureTool: key must be one character, got {key!r}")
        self.map = map
        self.half = map.add_browser_half(
            self,
            "features/measure/measure_tool.js",
            {"key": key},
            "features/measure/measure_tool.css",
        )
