"""``webmap.widget``: a map in a notebook."""

import inspect
import itertools
from pathlib import Path
from typing import Any

from webmap.base.errors import ConfigError, WebMapError
from webmap.core.base_page import PageEntry
from webmap.core.page import PageFunction
from webmap.core.runtime import runtime
from webmap.notebook.front_end import esm, sheet
from webmap.notebook.views import NotebookPages, Views

try:
    import anywidget
    from traitlets import Enum, Int, Unicode
except ImportError:
    raise WebMapError(
        "webmap.widget needs anywidget, which is not installed: "
        "pip install 'webmap[notebook]'"
    ) from None

LEAST_HEIGHT = 50

_numbers = itertools.count(1)
_pages: NotebookPages | None = None


class MapWidget(anywidget.AnyWidget):
    """The map of a page function in a notebook, for looking only.

    Each output cell that shows the widget has a page of its own, with the rights of a
    viewer and without a connection to the gate: no STOP, no driving, no events.
    """

    _esm = esm()
    sheet = Unicode(sheet()).tag(sync=True)
    """The style sheet."""
    height = Int(400, min=LEAST_HEIGHT).tag(sync=True)
    """The height of the map, in pixels."""
    theme = Enum(["auto", "light", "dark"], "auto").tag(sync=True)
    """``"auto"`` is the theme of the notebook."""

    def __init__(self, page: PageFunction, **traits: Any) -> None:
        super().__init__(**traits)
        entry = PageEntry(
            f"/notebook/{next(_numbers)}", page, None, _folder_of(page), "WebMap"
        )
        self._views = Views(_notebook_pages(), entry, self.send)
        self.on_msg(lambda _widget, content, _buffers: self._views.receive(content))

    def close(self) -> None:
        """Close the widget and the pages of all cells that show it."""
        # Jupyter calls it at the end too, also if the constructor has failed.
        if hasattr(self, "_views"):
            self._views.close()
        super().close()


def widget(page: PageFunction, *, height: int = 400, theme: str = "auto") -> MapWidget:
    """Return a map for an output cell of Jupyter, VS Code or marimo.

    It starts WebMap (:func:`start`), and opens no port: the picture goes over the
    notebook's own connection. It is for looking only: it has no STOP, robots are not
    driven and nothing can be clicked. What several cells show has one page for each.

    Args:
        page: A page function, as of :func:`page`: called with the page of each cell
            that shows the widget, in the model's thread. The map is in
            ``page.element("webmap_container")``.
        height: The height of the map in pixels, at least 50.
        theme: ``"light"``, ``"dark"``, or ``"auto"`` for that of the notebook.

    Raises:
        ConfigError: If the page is no function, or another argument is not valid.

    """
    if not callable(page):
        raise ConfigError(
            f"webmap.widget needs a page function, such as that of @webmap.page, got "
            f"{page!r}: a map belongs to one page"
        )
    if height < LEAST_HEIGHT or theme not in ("auto", "light", "dark"):
        raise ConfigError(
            f"a widget has a height of at least {LEAST_HEIGHT} and the theme auto, "
            f"light or dark: got {height} and {theme!r}"
        )
    shown = MapWidget(page, height=height, theme=theme)
    runtime.start()
    return shown


def _notebook_pages() -> NotebookPages:
    global _pages
    if _pages is None:
        _pages = NotebookPages()
        runtime.on_stop(_pages.close)
        runtime.serve_pages()
    return _pages


def _folder_of(page: PageFunction) -> Path:
    """Return the folder of a page's images: that of its file, or of the notebook."""
    source = inspect.getsourcefile(inspect.unwrap(page))
    is_cell = getattr(page, "__module__", "__main__") == "__main__"
    return Path.cwd() if source is None or is_cell else Path(source).resolve().parent
