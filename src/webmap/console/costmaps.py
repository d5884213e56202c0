"""Costmaps by their names, so that viewers can switch the local and the global one."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from webmap import Map


class CostmapNames:
    """Says which costmap each one is, for the list of layers; a module of maps.

    Robots that are alike are switched together, so the name is what their topics end
    in: ``global_costmap/costmap``.

    Args:
        map: The map.

    """

    def __init__(self, map: "Map") -> None:
        self.map = map

    def poll(self) -> None:
        """Name those that came since."""
        for module in self.map.modules:
            layer = getattr(module, "layer", None)
            if layer is None or getattr(layer, "palette", None) != "costmap":
                continue
            if "data-layer" not in layer.svg.attributes:
                layer.svg.set("data-layer", ending(layer.topic))


def ending(topic: str) -> str:
    """Return the last two parts of a topic's name."""
    return "/".join(topic.strip("/").split("/")[-2:])
