"""A scale bar on the map."""

from typing import TYPE_CHECKING

from webmap.core.registry import map_modules

if TYPE_CHECKING:
    from webmap.core.map import Map


@map_modules.register
class ScaleBar:
    """Shows the length of a round number of metres at the current zoom.

    Args:
        map: The map.
        width: Greatest width of the bar, in pixels.

    Raises:
        ValueError: If ``width`` is less than 20.
    """

    def __init__(self, map: "Map", width: int = 120) -> None:
        if width < 20:
            raise ValueError(f"ScaleBar: width must be at least 20 pixels, got {width}")
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/view/scale_bar.js",
            {"width": width},
            "features/view/view.css",
        )
