"""Maps from files on this machine."""

import asyncio
from pathlib import Path

from webmap.base.errors import ConfigError
from webmap.base.map_file import MapImage, cell_at, read_map
from webmap.base.tasks import spawn
from webmap.core.map import Layer, Map
from webmap.core.registry import map_modules
from webmap.features.layers.grid_picture import Palette, check_palette
from webmap.features.layers.grid_tiles import GridTiles


@map_modules.register
class MapFile:
    """Draws a map in the format of ROS's map_server: a YAML file and its image.

    The thresholds, ``negate`` and the mode of the file work as in map_server. The file
    is read in a thread; pages show the error if the file is not valid.

    Style it by CSS: ``.map-file``.

    Args:
        map: The map.
        file: The YAML file; its image is in the same folder or below.
        palette: ``"map"``, ``"costmap"`` or ``"raw"``, as for ``OccupancyGrid``.
        order: The drawing order: greater is nearer; a topic's map has 10.

    Raises:
        ConfigError: If there is no such palette.
    """

    def __init__(
        self,
        map: Map,
        file: str | Path,
        *,
        palette: Palette = "map",
        order: float = 5.0,
    ) -> None:
        check_palette(palette)
        self.map = map
        self.layer = FileLayer.shared(str(Path(file).absolute()), palette)
        self.layer.show_on(map, order=order)


class FileLayer(Layer):
    """One map from disk, for all maps that show it."""

    def __init__(self, file: str, palette: str) -> None:
        super().__init__()
        self.file = Path(file)
        self.palette = palette
        self.image: MapImage | None = None
        """The map; None until it is read."""
        self.svg.classes.add("map-file")
        self.svg.set(pointer_events="none")

    def start(self) -> None:
        """Begin to read the file."""
        self.tiles = GridTiles(self.svg, self.palette, self._fail)
        spawn(self._read())

    def cell_at(self, x: float, y: float) -> int | None:
        """Return the value of the cell at a place, -1 outside; None without a map."""
        image = self.image
        if image is None or self.palette != "map":
            return None
        return cell_at(image.cells, image.resolution, image.origin, x, y)

    async def _read(self) -> None:
        try:
            image = await asyncio.to_thread(read_map, self.file)
        except (ConfigError, MemoryError) as error:
            self._fail(str(error))
            return
        if self.scope.closed:
            return
        self.image = image
        self.tiles.show(image.cells, image.resolution, image.origin)

    def _fail(self, problem: str | None) -> None:
        """Show why the map cannot be drawn, or that it can."""
        if problem is None:
            self.clear_problem(self)
        else:
            self.set_problem(self, f"map {problem}")
