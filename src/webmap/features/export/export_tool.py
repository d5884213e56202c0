"""Saves the visible map as a picture."""

from collections.abc import Mapping
from typing import Any, ClassVar

from webmap.base.roles import Role
from webmap.base.text import counted
from webmap.core.map import Map
from webmap.core.registry import map_modules

MAX_TEXT = 200


@map_modules.register
class ExportTool:
    """Saves the visible map as SVG or PNG on the operator's or viewer's own machine.

    The file is self-contained: styles are written onto the elements, images are
    embedded, and there are no scripts.

    Args:
        map: The map.
        place: A CSS selector of the page's element for the button; by default the
            button is over the map.
        classes: CSS classes of the button in that element.
    """

    MAY_SEND: ClassVar[Mapping[str, Role]] = {"failed": "viewer", "missing": "viewer"}

    def __init__(self, map: Map, *, place: str = "", classes: str = "") -> None:
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/export/export_tool.js",
            {"place": place, "classes": classes},
            "web/tools/save_menu.css",
        )

    def on_message(self, message: dict[str, Any]) -> None:
        """Report what the page could not save."""
        failed, missing = message.get("failed"), message.get("missing")
        if isinstance(failed, str):
            self.map.report_error(f"the view was not saved: {failed[:MAX_TEXT]}")
        elif isinstance(missing, int):
            self.map.report_error(
                f"the view was saved without {counted(missing, 'image')} that could "
                "not be loaded"
            )
