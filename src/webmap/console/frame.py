"""The part of the console that lives in the browser, and the view it starts with."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from webmap import Map
    from webmap.console.floor import Floor

MARGIN = 4.0
"""Metres around robots that are shown without a floor."""

DOT_PIXELS = 3.0
"""How large the dots of a scan are on the screen."""

PARTS = (
    "card_actions.js",
    "connection.js",
    "dom.js",
    "help.js",
    "into_view.js",
    "names.js",
    "search.js",
    "sheet.js",
    "stop_test.js",
    "view_tools.js",
)
"""What console.js imports; a browser can load what was published."""

PATIENCE = 12
"""Looks after which robots whose pose is unknown are waited for no longer."""

Bounds = tuple[float, float, float, float]
"""Left, bottom, width and height, in metres."""


class Frame:
    """Connection state, zoom buttons, help and the card's buttons; a module of maps.

    All of it acts in the browser, since it must work over a bad link, and some of it
    just then.

    Args:
        map: The map.
        title: What this installation is called.
        floor: The floor plan, if there is one.

    """

    def __init__(self, map: "Map", title: str, floor: "Floor | None") -> None:
        self.map = map
        self._bounds = None if floor is None else floor.bounds
        self._looks = 0
        self._placed = False
        self._dot_size = 0.0
        folder = Path(__file__).parent
        for name in PARTS:
            map.page.asset(folder / name)
        self.half = map.add_browser_half(
            self,
            folder / "console.js",
            {"title": title, "bounds": self._bounds},
        )

    def place(self) -> None:
        """Show the floor, or the robots where they are as soon as that is known."""
        self._looks += 1
        bounds = self._bounds or self._around_robots()
        if bounds is not None and not self._placed:
            self._placed = True
            self.map.fit(*bounds)

    def on_own_view(self) -> None:
        """Leave the view to a page that begins with the one it was left with."""
        self._placed = True

    def on_view_found(self) -> None:
        """Show what the page begins with, when nobody left it with another view."""
        self._placed = False
        self.place()

    def on_view(self) -> None:
        """Keep the dots of scans as large on the screen, whatever the zoom."""
        scale = math.sqrt(abs(self.map.world.tf.determinant))
        size = min(max(DOT_PIXELS / max(scale, 1e-3), 0.02), 0.3)
        if abs(size - self._dot_size) > 0.1 * size:
            self._dot_size = size
            self.map.root.set_style("--dot-size", round(size, 3))

    def on_message(self, message: dict[str, Any]) -> None:
        """Follow the selected robot, from the middle, which the page asks for."""
        robot = self.map.selected
        if message.get("op") != "follow" or robot is None:
            return
        x, y = self.map.world.tf.apply(robot.position.x, robot.position.y)
        self.map.translate(
            self.map.canvas_width / 2 - x, self.map.canvas_height / 2 - y
        )
        self.map.follow(robot)

    def _around_robots(self) -> Bounds | None:
        places = [robot.position for robot in self.map.robots if robot.valid]
        waiting = len(places) < len(self.map.robots) and self._looks < PATIENCE
        if not places or waiting:
            return None
        left, bottom = min(p.x for p in places), min(p.y for p in places)
        right, top = max(p.x for p in places), max(p.y for p in places)
        return (
            left - MARGIN,
            bottom - MARGIN,
            right - left + 2 * MARGIN,
            top - bottom + 2 * MARGIN,
        )
