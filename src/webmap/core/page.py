"""Pages: the open browser tabs, and the functions that build them."""

import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

from webmap.base.errors import ConfigError
from webmap.base.plain_files import resolved
from webmap.core.base_page import BasePage, PageEntry
from webmap.core.map import Map
from webmap.core.world_view import initial_view

MADE_PAGE_MODULES = ("MetreGrid", "MouseViewControl")
"""Modules that maps get on a generated page."""

MADE_PAGE_SCALE = 20.0
"""Pixels per metre of such a map, unless the page function chooses a view."""


class Page(BasePage):
    """One page of one viewer; created when it opens, and removed when it closes."""

    @property
    def maps(self) -> list[Map]:
        """The maps of the page, in the order in which they were created."""
        return [part for part in self.contents if isinstance(part, Map)]

    def complete(self) -> None:
        """Complete the maps of a page whose HTML WebMap generates.

        Each map gets the modules of ``MADE_PAGE_MODULES`` that the page function did
        not add, and a view if the page function set none.
        """
        for map in self.maps if self.entry.html is None else ():
            if map.world.tf == initial_view(map.canvas_width, map.canvas_height):
                map.scale(MADE_PAGE_SCALE)
            kinds = [kind for module in map.modules for kind in type(module).__mro__]
            there = {kind.__name__ for kind in kinds}
            for name in MADE_PAGE_MODULES:
                if name not in there:
                    map.add_module(name)


PageFunction: TypeAlias = Callable[[Page], Any]
"""Builds a page for the viewer that opened it."""


class Site:
    """The pages of this process, by path."""

    def __init__(self) -> None:
        self.pages: dict[str, PageEntry] = {}

    def page(
        self, path: str, *, html: str | Path | None = None, title: str = "WebMap"
    ) -> Callable[[PageFunction], PageFunction]:
        """Build a page for each viewer that opens ``path`` (decorator).

        Args:
            path: The path of the page from the application's root: ``"/"``, ``"/lab"``.
            html: The HTML file to serve, relative to the script's folder; if not given,
                a page with one container, ``webmap_container``, is generated. The page
                can load the files in the same folder.
            title: The title of a generated page.

        Raises:
            ConfigError: If the path is not valid, or the HTML file does not exist.

        """
        taken = path.startswith("/_webmap") or path in {"/healthz", "/metrics"}
        if not re.fullmatch(r"/[A-Za-z0-9._~/-]*", path) or taken:
            raise ConfigError(
                f"a page's path is '/' and letters, digits, '.', '_', '~', '-' or '/', "
                f"neither below '/_webmap' nor '/healthz' or '/metrics': got {path!r}"
            )

        def register(function: PageFunction) -> PageFunction:
            source = inspect.getsourcefile(function)
            folder = Path(source).resolve().parent if source else Path.cwd()
            file = None
            if html is not None:
                file = resolved(folder / html)
                if not file.is_file():
                    raise ConfigError(f"page {path!r}: there is no file {file}")
                folder = file.parent
            self.pages[path] = PageEntry(path, function, file, folder, title)
            return function

        return register


site = Site()
"""The pages of this process."""
