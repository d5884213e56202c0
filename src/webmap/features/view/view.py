"""The view of a map: its control, the robot it follows, and what lies over the map."""

from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

from webmap.base.errors import ConfigError
from webmap.base.roles import Role
from webmap.core.map import Map
from webmap.core.registry import map_modules
from webmap.modules.declaration import declarations
from webmap.scene.element import Element


@map_modules.register
class MouseViewControl:
    """A drag moves the view, the wheel zooms, Shift and the wheel rotate.

    On a touch screen two fingers zoom and rotate. The release that ends a drag is not a
    click. The module runs in the browser, which owns the view.
    """

    def __init__(self, map: Map) -> None:
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/view/mouse_view_control.js",
            style="features/view/view.css",
        )


MapViewControl = map_modules.register(MouseViewControl, name="MapViewControl")
"""An alias, the name in the report of 2012."""


@map_modules.register
class Follow:
    """A button that keeps the selected robot at its place on the screen.

    Following ends when the user moves the view.
    """

    MAY_SEND: ClassVar[Mapping[str, Role]] = {"follow": "viewer"}

    def __init__(self, map: Map) -> None:
        self.map = map
        self.browser_part = map.add_browser_part(
            self, "features/view/follow.js", {}, "features/view/view.css"
        )

    def on_message(self, message: dict[str, Any]) -> None:
        """Follow the robot in the page's message, or none."""
        self.map.follow(self.map.find_robot(message.get("follow")))


@map_modules.register
class MetreGrid:
    """Draws thin lines below the map, a round number of metres apart.

    The distance between two lines follows the zoom: it is the least of 1, 2, 5, 10 and
    so on that has room. WebMap's own pages have this module.

    Args:
        map: The map.
        least: The least distance between two lines, in pixels.

    Raises:
        ValueError: If ``least`` is less than 4.
    """

    def __init__(self, map: Map, least: int = 32) -> None:
        if least < 4:
            raise ValueError(f"MetreGrid: least must be at least 4 pixels, got {least}")
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/view/metre_grid.js",
            {"least": least},
            "features/view/view.css",
        )


@map_modules.register
class ScaleBar:
    """Shows the length of a round number of metres at the current zoom.

    Args:
        map: The map.
        width: Greatest width of the bar, in pixels.

    Raises:
        ValueError: If ``width`` is less than 20.
    """

    def __init__(self, map: Map, width: int = 120) -> None:
        if width < 20:
            raise ValueError(f"ScaleBar: width must be at least 20 pixels, got {width}")
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/view/scale_bar.js",
            {"width": width},
            "features/view/view.css",
        )


@map_modules.register
class PointerReadout:
    """Shows the world coordinates of the pointer, in metres.

    Args:
        map: The map.
        digits: Number of digits after the decimal point.

    Raises:
        ValueError: If ``digits`` is not in 0 to 6.
    """

    def __init__(self, map: Map, digits: int = 2) -> None:
        if not 0 <= digits <= 6:
            raise ValueError(f"PointerReadout: digits must be 0 to 6, got {digits}")
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/view/pointer_readout.js",
            {"digits": digits},
            "features/view/view.css",
        )


@map_modules.register
class ShowSelected:
    """Shows the name of the selected robot in an element of the page.

    Args:
        map: The map.
        element: The element; the name replaces its content.
        default_msg: The text while no robot is selected.
    """

    def __init__(
        self, map: Map, element: Element, default_msg: str = "No selection"
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


LAYERS = {
    "Tiles": ".tiles",
    "Maps": ".floor, .map-file",
    "Pictures": ".images > image:not(.floor)",
    "Costmaps": "",
    "Cells": "",
    "Scans": "",
    "Clouds": "",
    "Plans": "",
    "Trails": ".trail",
    "Poses": "",
    "Points": "",
    "Uncertainty": "",
    "Footprints": "",
    "Ranges": "",
    "Markers": "",
    "Satellite fixes": "",
    "Labels": ".labels",
    "Health": "",
}
"""Names in the order of the list, with the CSS selectors of content without topics.

Layers declare their own selectors; names that are not here come last.
"""


def all_layers() -> dict[str, str]:
    """Return the CSS selector of each name, of all layers."""
    selectors = {
        name: [selector] if selector else [] for name, selector in LAYERS.items()
    }
    for declared in declarations():
        for name, selector in declared.switches.items():
            if name:
                selectors.setdefault(name, []).append(selector)
    return {name: ", ".join(parts) for name, parts in selectors.items()}


@map_modules.register
class LayerSwitches:
    """A list of the layers of the map, each with a switch.

    Only layers with present content are listed. A layer with different drawings, such
    as two scans or two maps, also has a switch for each of them; drawings of one among
    several robots are listed below its name. A further switch leaves only the layers of
    the selected robot. Each browser stores
    its own choice. Robots still send data of layers that are off; WebMap sends no dots
    of them to the page.

    Args:
        map: The map.
        layers: A CSS selector for each name, in the order of the list; by default the
            names of all layers and of ``map.add_image``.
        off: Names that are off until the user switches them on.
        several_off: Names that are off at first where several robots have such a layer.
        legend: A CSS selector of the page's element that explains the colours; the list
            ends with it.

    Raises:
        ConfigError: If a name in ``off`` or ``several_off`` is not in ``layers``.
    """

    def __init__(
        self,
        map: Map,
        layers: Mapping[str, str] | None = None,
        *,
        off: Iterable[str] = (),
        several_off: Iterable[str] = (),
        legend: str = "",
    ) -> None:
        chosen = dict(all_layers() if layers is None else layers)
        hidden, several_hidden = list(off), list(several_off)
        for name in hidden + several_hidden:
            if name not in chosen:
                known = ", ".join(chosen)
                raise ConfigError(
                    f"LayerSwitches: no layer {name!r}; there are {known}"
                )
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/view/layer_switches.js",
            {
                "layers": [list(item) for item in chosen.items()],
                "off": hidden,
                "several_off": several_hidden,
                "legend": legend,
            },
            "features/view/view.css",
        )
