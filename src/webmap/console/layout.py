"""The layout of one viewer's page: kept, saved to a file, loaded from one."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from webmap import Map


class Layout:
    """Saves and loads what a viewer sees of the page; a module of maps.

    All of it is the browser's: the view, what is switched on, which panels are open,
    where the camera is. No robot, selection, lease or goal is any part of it, and the
    page sends nothing but what :meth:`on_message` takes.

    Fires ``on_own_view()`` when the page has shown the view that it was left with, and
    ``on_view_found()`` when the viewer wants the one that it would begin with else.

    Args:
        map: The map.
        of: What the page shows: the last view is kept for that and the page's address.
        place: A CSS selector of the page's element that the button goes into; over the
            map if not given.
        classes: What the button is styled by there.
        restore: Whether the page opens with the last view.

    """

    def __init__(
        self,
        map: "Map",
        *,
        of: str = "",
        place: str = "",
        classes: str = "",
        restore: bool = True,
    ) -> None:
        self.map = map
        self.half = map.add_browser_half(
            self,
            "modules/layout_tool.js",
            {"of": of, "place": place, "classes": classes, "restore": restore},
            "modules/layout_tool.css",
        )

    def on_message(self, message: dict[str, Any]) -> None:
        """Take what the page says of its view."""
        if message.get("own") is True:
            self.map.notify_modules("on_own_view")
            # Behind what was said of the view before this was known.
            self.half.send({"own": True})
        elif message.get("found") is True:
            self.map.notify_modules("on_view_found")
