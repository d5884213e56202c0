"""A grid below the map that shows distances and motion."""

from typing import TYPE_CHECKING

from webmap.core.registry import map_modules

if TYPE_CHECKING:
    from webmap.core.map import Map


@map_modules.register
class MetreGrid:
    """Draws thin lines below the map, a round number of metres apart.

    The distance between two lines follows the zoom: it is the least of 1, 2, 5, 10 and
    so on that has room. WebMap's own pages have this module.

    Args:
        map: The map.
        least: The least distance between two lines, in pixels.

    Raises:
        ValueError: If ``least`` is less than 4.
    """

    def __init__(self, map: "Map", least: int = 32) -> None:
        if least < 4:
            raise ValueError(f"MetreGrid: least must be at least 4 pixels, got {least}")
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/view/metre_grid.js",
            {"least": least},
            "features/view/view.css",
        )
