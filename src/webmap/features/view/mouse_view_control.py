"""Changes the view by mouse, wheel and touch."""

from typing import TYPE_CHECKING

from webmap.core.registry import map_modules

if TYPE_CHECKING:
    from webmap.core.map import Map


@map_modules.register
class MouseViewControl:
    """A drag moves the view, the wheel zooms, Shift and the wheel rotate.

    On a touch screen two fingers zoom and rotate. The release that ends a drag is not a
    click. The module runs in the browser, which owns the view.
    """

    def __init__(self, map: "Map") -> None:
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/view/mouse_view_control.js",
            style="features/view/view.css",
        )
