"""Makes the view follow a robot."""

from typing import TYPE_CHECKING, Any

from webmap.core.registry import map_modules

if TYPE_CHECKING:
    from webmap.core.map import Map


@map_modules.register
class Follow:
    """A button that keeps the selected robot at its place on the screen.

    Following ends when the user moves the view.
    """

    def __init__(self, map: "Map") -> None:
        self.map = map
        self.browser_part = map.add_browser_part(
            self, "features/view/follow.js", {}, "features/view/view.css"
        )

    def on_message(self, message: dict[str, Any]) -> None:
        """Follow the robot in the page's message, or none."""
        self.map.follow(self.map.find_robot(message.get("follow")))
