"""STOP buttons that are always visible."""

from webmap.core.map import Map
from webmap.core.registry import map_modules


@map_modules.register
class StopButton:
    """A large red button that stops robots, regardless of who has control.

    STOP does not require control, and the page sends it to the gate itself.

    Args:
        map: The map.
        place: A CSS selector of the page's element for the button; by default the
            button is over the map.
    """

    def __init__(self, map: Map, *, place: str = "") -> None:
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/stop/stop_button.js",
            {"place": place},
            "features/stop/stop_button.css",
        )
