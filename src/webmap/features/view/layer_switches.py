"""Switches for the layers of the map, for each page."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from webmap.base.errors import ConfigError
from webmap.core.registry import map_modules
from webmap.modules.declaration import declarations

if TYPE_CHECKING:
    from webmap.core.map import Map

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
    as two scans or two maps, also has a switch for each of them. Each browser stores
    its own choice. Robots still send data of layers that are off; WebMap sends no dots
    of them to the page.

    Args:
        map: The map.
        layers: A CSS selector for each name, in the order of the list; by default the
            names of all layers and of ``map.add_image``.
        off: Names that are off until the user switches them on.

    Raises:
        ConfigError: If a name in ``off`` is not in ``layers``.
    """

    def __init__(
        self,
        map: "Map",
        layers: Mapping[str, str] | None = None,
        *,
        off: Iterable[str] = (),
    ) -> None:
        chosen = dict(all_layers() if layers is None else layers)
        hidden = list(off)
        for name in hidden:
            if name not in chosen:
                known = ", ".join(chosen)
                raise ConfigError(
                    f"LayerSwitches: no layer {name!r}; there are {known}"
                )
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/view/layer_switches.js",
            {"layers": [list(item) for item in chosen.items()], "off": hidden},
            "features/view/view.css",
        )
