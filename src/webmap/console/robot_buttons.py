"""The buttons of the selected robot, on its card."""

from typing import TYPE_CHECKING, Any

from webmap import html

if TYPE_CHECKING:
    from webmap import Element, Map


class RobotButtons:
    """Shows the buttons of the robot that is selected; a module of maps.

    Args:
        map: The map.
        card: The page's element to append to.

    """

    def __init__(self, map: "Map", card: "Element") -> None:
        self.map = map
        self.element: Element = html.section(class_="card-buttons")
        self.element.set("aria-label", "Buttons")
        card.append(self.element)
        self._shown: list[Any] = []
        self.on_select()

    def destroy(self) -> None:
        """Take the buttons away."""
        self._let_go()
        self.element.remove()

    def on_select(self) -> None:
        """Show the buttons of the robot that is selected now."""
        self._let_go()
        robot = self.map.selected
        modules = [] if robot is None else robot.modules
        self._shown = [
            module.show_buttons_in(self.element)
            for module in modules
            if hasattr(module, "show_buttons_in")
        ]

    def _let_go(self) -> None:
        for shown in self._shown:
            shown.remove()
        self._shown = []
