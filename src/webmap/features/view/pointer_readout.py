"""Shows the pointer's position."""

from typing import TYPE_CHECKING

from webmap.core.registry import map_modules

if TYPE_CHECKING:
    from webmap.core.map import Map


@map_modules.register
class PointerReadout:
    """Shows the world coordinates of the pointer, in metres.

    Args:
        map: The map.
        digits: Number of digits after the decimal point.

    Raises:
        ValueError: If ``digits`` is not in 0 to 6.
    """

    def __init__(self, map: "Map", digits: int = 2) -> None:
        if not 0 <= digits <= 6:
            raise ValueError(f"PointerReadout: digits must be 0 to 6, got {digits}")
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/view/pointer_readout.js",
            {"digits": digits},
            "features/view/view.css",
        )
