"""What is drawn on the map, switched on and off by each viewer."""

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
"""The names in the order of the list, with the CSS selectors of what is not drawn from
a topic. Layers declare theirs; those with other names come last."""


def all_layers() -> dict[str, str]:
    """Return the CSS selector of each name, of all layers there are."""
    selectors = {name: [said] if said else [] for name, said in LAYERS.items()}
    for declared in declarations():
        for name, selector in declared.switches.items():
            if name:
                selectors.setdefault(name, []).append(selector)
    return {name: ", ".join(said) for name, said in selectors.items()}


@map_modules.register
class LayerSwitches:
    """A list of what the map shows, each to be switched on and off.

    Only what is there at the time is listed. A layer that draws different things, such
    as two scans or two maps, has a switch for each of them besides. The choice is the
    viewer's own and is kept in that browser; what is switched off still comes from the
    robot.

    Args:
        map: The map.
        layers: A CSS selector for each name, in the order of the list; what
            layers and ``map.add_image`` draw if not given.
        off: Names of those that are off until the viewer switches them on.

    Raises:
        ConfigError: If ``off`` has a name that is not in ``layers``.

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
        self.half = map.add_browser_half(
            self,
            "features/view/layer_switches.js",
            {"layers": [list(item) for item in chosen.items()], "off": hidden},
            "features/view/layer_switches.css",
        )
