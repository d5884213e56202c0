"""``webmap.widget``: a map in a notebook.

A widget has a view for each output cell that shows it: a page without rights, over the
connection of the notebook. A message of a view has its ``view``, an identifier, and
``text``, the message of a page; without a text the view has gone. A message to a view
has one of these:

- a frame as its first buffer, and in ``pictures`` those that the frame names;
- ``unknown``: the view must send its hello again;
- ``ended``: why the page was closed.
"""

import asyncio
import base64
import contextvars
import functools
import inspect
import itertools
import logging
import re
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from webmap.base.errors import ConfigError, WebMapError, WireError
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import PageFunction
from webmap.core.runtime import runtime
from webmap.scene.wire.messages import (
    PageHello,
    Resync,
    Seen,
    Trouble,
    Unseen,
    ViewReport,
    read_message,
)
from webmap.server.bundles import served_modules, served_sheets
from webmap.server.files import IMAGES, NoSuchFile, Published
from webmap.server.open_pages import OpenPages

try:
    import anywidget
    from traitlets import Enum, Int, Unicode
except ImportError:
    raise WebMapError(
        "webmap.widget needs anywidget, which is not installed: "
        "pip install 'webmap[notebook]'"
    ) from None

log = logging.getLogger("webmap.notebook")

ALLOWED = (PageHello, Seen, Unseen, Resync, ViewReport, Trouble)
"""What a view may send: that it has drawn a frame, what it shows, and failures. No
event reaches a module or a handler."""

LOOKER = Viewer("notebook", "a notebook", role="viewer")
"""The viewer of all views. No view has a connection to the gate."""

SILENT_S = 150.0
"""Seconds after which a silent view is closed. A hidden tab may send once a minute."""

MOST_ID = 64
"""Characters of the identifier of a view."""

MOST_VIEWS = 20
"""Views of one widget; of more, the one that was silent longest is closed."""

Send = Callable[[dict[str, Any], list[bytes]], object]
"""Sends a message with buffers to all views of a widget."""

LEAST_HEIGHT = 50

START = "notebook/widget.js"

_numbers = itertools.count(1)
_PICTURE = re.compile(re.escape(IMAGES.encode()) + rb"([0-9a-f]{32})")


class NotebookPages(OpenPages):
    """The pages of all views. No view comes back, so a lost page is closed at once."""

    def __init__(self) -> None:
        self.published = Published()
        self.entries: dict[str, PageEntry] = {}
        super().__init__(runtime, self.entries, self.published, max_pages=1000)

    @property
    def kept_for(self) -> float:
        """Zero seconds."""
        return 0.0

    def freeze(self) -> None:
        """Leave the objects of the kernel to the collector: they are not WebMap's."""


class View:
    """The socket of one view's page; in the model's thread."""

    def __init__(self, id: str, pages: NotebookPages, path: str, send: Send) -> None:
        self.heard_at = time.monotonic()
        self.over = False
        self._id = id
        self._published = pages.published
        self._send = send
        self._handle = pages.open_scene(path, id, LOOKER, self)

    def receive(self, text: str) -> None:
        """Pass a message of the page."""
        self.heard_at = time.monotonic()
        self._handle.receive(text)

    def offer(self, item: bytes | str) -> None:
        """Send a frame, with the pictures that it names."""
        frame = item.encode() if isinstance(item, str) else item
        pictures = {}
        for tag in {found.decode() for found in _PICTURE.findall(frame)}:
            try:
                file = self._published.image(tag)
            except NoSuchFile:
                continue
            data = base64.b64encode(file.data).decode()
            pictures[IMAGES + tag] = f"data:{file.media_type};base64,{data}"
        self._send({"view": self._id, "pictures": pictures}, [frame])

    def end(self, code: int, reason: str) -> None:
        """Report why the page was closed."""
        del code
        self.over = True
        self._send({"view": self._id, "ended": f"This map has ended: {reason}."}, [])

    def close(self) -> None:
        """Close the page."""
        self.over = True
        self._handle.closed()


class Views:
    """The views of one widget.

    Args:
        pages: The pages of all widgets.
        entry: The page that each view shows.
        send: Sends a message; called in the model's thread.

    """

    def __init__(self, pages: NotebookPages, entry: PageEntry, send: Send) -> None:
        self._pages = pages
        self._path = entry.path
        self._send_now = send
        self._context = contextvars.Context()
        """That of the last message. By it ipykernel knows the thread that waits for
        the answers: without it they would wait for the end of a cell that runs."""
        self._views: dict[str, View] = {}
        self._next_look: asyncio.TimerHandle | None = None
        pages.entries[entry.path] = entry

    def receive(self, message: object) -> None:
        """Receive a message of the notebook, valid or not; from any thread."""
        if isinstance(message, Mapping) and runtime.running:
            runtime.call(self._receive, message.get("view"), message.get("text"))

    def close(self) -> None:
        """Close all views; from any thread."""
        if runtime.running:
            runtime.call(self._close_all)

    def _send(self, content: dict[str, Any], buffers: list[bytes]) -> None:
        self._context.run(self._send_now, content, buffers)

    def _receive(self, id: object, text: object) -> None:
        self._context = contextvars.copy_context()
        if not isinstance(id, str) or len(id) > MOST_ID:
            return
        if not isinstance(text, str):
            self._forget(id)
            return
        try:
            message = read_message(text)
        except WireError as error:
            log.warning("a map in a notebook: %s", error)
            return
        view = self._views.get(id)
        if not isinstance(message, ALLOWED):
            log.warning("a map in a notebook is for looking only: refused %r", message)
        elif view is not None and not view.over:
            view.receive(text)
        elif isinstance(message, PageHello):
            self._forget(id)
            self._open(id).receive(text)
        else:
            self._send({"view": id, "unknown": True}, [])

    def _open(self, id: str) -> View:
        if len(self._views) >= MOST_VIEWS:
            self._forget(min(self._views, key=lambda id: self._views[id].heard_at))
        view = self._views[id] = View(id, self._pages, self._path, self._send)
        if self._next_look is None:
            self._look_later()
        return view

    def _forget(self, id: str) -> None:
        view = self._views.pop(id, None)
        if view is not None:
            view.close()

    def _look_later(self) -> None:
        loop = asyncio.get_running_loop()
        self._next_look = loop.call_later(SILENT_S / 10, self._look)

    def _look(self) -> None:
        self._next_look = None
        silent_since = time.monotonic() - SILENT_S
        for id, view in tuple(self._views.items()):
            if view.over or view.heard_at < silent_since:
                self._forget(id)
        if self._views:
            self._look_later()

    def _close_all(self) -> None:
        for id in tuple(self._views):
            self._forget(id)


def _sources(suffix: str) -> dict[str, str]:
    package = Path(__file__).parents[1]
    folders = ("notebook", "web", "features/view")
    paths = (path for folder in folders for path in (package / folder).rglob("*.*"))
    return {
        path.relative_to(package).as_posix(): path.read_text("utf-8")
        for path in sorted(paths)
        if path.suffix == suffix
    }


def esm() -> str:
    """Return the ES module with all that it imports."""
    sources = _sources(".js")
    # The engine finds pictures there, and not at a server.
    sources["web/access.js"] = sources.pop("notebook/addresses.js")
    start = sources[START].replace('"./addresses.js"', '"../web/access.js"')
    text = served_modules(sources | {START: start}, (START,))[START]
    return text.partition("//# sourceMappingURL=")[0]


def sheet() -> str:
    """Return the style sheet of the shadow root that contains a map."""
    sheets = served_sheets(_sources(".css"), shared="")
    names = ("web/webmap.css", "features/view/view.css", "notebook/widget.css")
    return "".join(sheets[name] for name in names).replace(":root", ":host")


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


@functools.cache
def _notebook_pages() -> NotebookPages:
    pages = NotebookPages()
    runtime.on_stop(pages.close)
    runtime.serve_pages()
    return pages


def _folder_of(page: PageFunction) -> Path:
    """Return the folder of a page's images: that of its file, or of the notebook."""
    source = inspect.getsourcefile(inspect.unwrap(page))
    is_cell = getattr(page, "__module__", "__main__") == "__main__"
    return Path.cwd() if source is None or is_cell else Path(source).resolve().parent
