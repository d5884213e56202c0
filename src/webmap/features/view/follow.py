"""The view goes with a robot."""

from typing import TYPE_CHECKING, Any

from webmap.core.registry import map_modules

if TYPE_CHECKING:
    from webmap.core.map import Map


@map_modules.register
class Follow:
    """A button that keeps the selected robot where it is on the screen.

    It ends when the viewer moves the view by hand.
    """

    def __init__(self, map: "Map") -> None:
        self.map = map
        self.half = map.add_browser_half(
            self, "features/view/follow.js", {}, "features/view/follow.css"
        )

    def on_message(self, message: dict[str, Any]) -> None:
        """Follow the robot that the page names, or none."""
        self.map.follow(self.map.find_robot(message.get("follow")))
