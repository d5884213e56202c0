"""What the parts of the selected robot say of their health, on its card."""

from typing import TYPE_CHECKING, Any

from webmap import html
from webmap.console.doctor import entry

if TYPE_CHECKING:
    from webmap import Element, Map

MOST = 6
"""Parts that are listed; the worst come first."""

LEVELS = {
    "error": ("wrong", "Error"),
    "stale": ("note", "Silent"),
    "warn": ("warning", "Warning"),
    "ok": ("good", "Well"),
}
"""For each level of diagnostics its shape and colour, and its word."""


class RobotHealth:
    """Lists the parts of the selected robot that are not well; a module of maps.

    A robot without diagnostics has no such list. One of which all is well has one line,
    and so has one of which nothing was heard.

    Args:
        map: The map.
        card: The page's element to append to.

    """

    def __init__(self, map: "Map", card: "Element") -> None:
        self.map = map
        self._list = html.ul()
        self.element: Element = html.section(
            html.h3(text="Health"), self._list, class_="card-health", hidden=True
        )
        self.element.set("aria-label", "Health")
        card.append(self.element)
        self._shown: list[tuple[str, str, str]] = []
        self.on_select()

    def destroy(self) -> None:
        """Take the list away."""
        self.element.remove()

    def on_select(self) -> None:
        """Show the health of the robot that is selected now."""
        self.poll()

    def poll(self) -> None:
        """Look at the parts again; those that say nothing become silent by that."""
        robot = self.map.selected
        modules = [] if robot is None else robot.modules
        found = [module for module in modules if _follows(module)]
        said = _lines([part for module in found for part in module.parts])
        if found and not said:
            said = [("note", "Unheard: ", "no part of this robot says how it is")]
        if said == self._shown:
            return
        self._shown = said
        self._list.clear()
        for level, word, words in said:
            self._list.append(entry(level, word, words))
        self.element.set(hidden=not said)


def _follows(module: Any) -> bool:
    """Tell whether a module follows diagnostics."""
    return hasattr(module, "parts") and hasattr(module, "hold")


def _lines(parts: list[Any]) -> list[tuple[str, str, str]]:
    """Return what is wrong, or that all is well; nothing if no part tells either."""
    bad = [part for part in parts if part.level != "ok"]
    lines = []
    for part in bad[:MOST]:
        level, word = LEVELS[part.level]
        # A count of seconds would be another line every second.
        words = "" if part.level == "stale" else f": {part.message}"
        whose = " (of some robot here)" if part.shared else ""
        lines.append((level, f"{word}: ", f"{part.name}{whose}{words}"))
    if len(bad) > MOST:
        lines.append(("note", "", f"and {len(bad) - MOST} more parts"))
    # That the parts of nobody are well tells nothing of this robot.
    if not bad and any(not part.shared for part in parts):
        count = f"{len(parts)} part{'' if len(parts) == 1 else 's'}"
        lines.append(("good", "All is well: ", count))
    return lines
