"""Shows the name of the selected robot in an element of the page."""

from typing import TYPE_CHECKING

from webmap.core.registry import map_modules
from webmap.scene.element import Element

if TYPE_CHECKING:
    from webmap.core.map import Map


@map_modules.register
class ShowSelected:
    """Shows the name of the selected robot in an element of the page.

    Args:
        map: The map.
        element: The element; the name replaces its content.
        default_msg: The text while no robot is selected.
    """

    def __init__(
        self, map: "Map", element: Element, default_msg: str = "No selection"
    ) -> None:
        self.map = map
        self.element = element
        self.default_msg = default_msg
        self.on_select()

    def destroy(self) -> None:
        """Clear the element."""
        self.element.text = ""

    def on_select(self) -> None:
        """Show the name of the robot that is selected now."""
        selected = self.map.selected
        self.element.text = self.default_msg if selected is None else selected.name
