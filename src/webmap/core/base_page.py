"""What maps, layers and robots use of a page: elements, events, images, speeds."""

import logging
import weakref
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from webmap.base.errors import ConfigError, NotAllowed
from webmap.base.plain_files import resolved
from webmap.base.roles import Role
from webmap.base.scope import Removal, Scope, current_scope
from webmap.base.tasks import begin
from webmap.core.operators import Viewer
from webmap.core.pictures import Publisher
from webmap.scene.document import BoundElement, Document
from webmap.scene.element import Element, Event, Handler, Listener
from webmap.scene.node import Fragment
from webmap.scene.wire.session import SceneSession

log = logging.getLogger("webmap.page")


class PageSpeeds:
    """The greatest speeds of a page's modules, and the module with active input."""

    def __init__(self) -> None:
        self._most: dict[int, tuple[float, float]] = {}
        self._driving: int | None = None

    @property
    def current(self) -> tuple[float, float]:
        """The greatest speeds that the page asks for now, in m/s and rad/s.

        They are those of the module with active input; without active input, the lowest
        of all modules; zero without a module that drives.
        """
        if not self._most:
            return (0.0, 0.0)
        if self._driving in self._most:
            return self._most[self._driving]
        linear, angular = zip(*self._most.values(), strict=True)
        return (min(linear), min(angular))

    def set(self, module: object, speed: float, rotation_speed: float) -> None:
        """Set the greatest speeds of a module that drives, in m/s and rad/s."""
        self._most[id(module)] = (speed, rotation_speed)

    def drive(self, module: object, on: bool) -> None:
        """Set whether a module has active input."""
        if on:
            self._driving = id(module)
        elif self._driving == id(module):
            self._driving = None

    def clear(self, module: object) -> None:
        """Remove a module that no longer drives."""
        self._most.pop(id(module), None)
        self.drive(module, False)


@dataclass(frozen=True, slots=True)
class PageEntry:
    """A path, and the function that builds a page for each viewer that opens it."""

    path: str
    function: Callable[..., Any]
    """Called with the new page."""

    html: Path | None
    folder: Path
    title: str


ListenerKey = tuple[int, int, str]
"""The target of a listener: a mount, one of its elements and an event."""


class Contents(Protocol):
    """A part of a page that ends with it, such as a map."""

    def destroy(self) -> None:
        """Remove the part from the page."""


class BasePage:
    """A page as its maps know it; base class of every page."""

    def __init__(
        self,
        entry: PageEntry,
        channel: SceneSession,
        viewer: Viewer,
        publisher: Publisher,
        sizes: Mapping[str, tuple[float, float]],
        window: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self.entry = entry
        self.channel = channel
        self.viewer = viewer
        self.contents: list[Contents] = []
        """What is destroyed when the page closes, the newest first."""
        self.scope = Scope(f"page {entry.path}", lambda text, _: self.notice(text))
        self.closed = False
        self.publisher = publisher
        self._sizes, self._window = dict(sizes), window
        self._document = Document()
        self.fragment = Fragment(self._document)
        self.mount = channel.mount(self.fragment, under=0)
        """The mount of the page's own elements."""
        _pages[self.fragment.id] = self
        self.on_speeds: Callable[[float, float], None] | None = None
        self.on_move: Callable[[str, float, float, float], None] | None = None
        self._speeds = PageSpeeds()
        self._listening: dict[ListenerKey, tuple[Listener, ...]] = {}

    def element(self, id: str) -> Element:
        """Return the page's own element with this ``id``, to fill and to listen to.

        Args:
            id: The ``id`` in the page's HTML. If the HTML has none, the page shows an
                error.

        """
        return self._document.bind(id)

    def size_of(self, container: Element) -> tuple[float, float]:
        """Return the width and height that a container had when the page opened.

        In pixels. If the page did not show the container, or did not know its size yet,
        this is the size of the window: the console and generated pages connect before
        their style sheets are there.
        """
        if isinstance(container, BoundElement):
            return self._sizes.get(container.html_id, self._window)
        return self._window

    def on_close(self, fn: Callable[[], object]) -> Removal:
        """Call ``fn`` when the page is closed permanently."""
        removal = Removal(fn)
        self.scope.add(removal)
        return removal

    def image(self, href: str) -> str:
        """Return a URL by which the page can load an image until the page closes.

        Args:
            href: A file in the page's folder, or an absolute path.

        Raises:
            ConfigError: If the file does not exist, lies outside the folder or is no
                image.

        """
        return self.publish_image(href)[0]

    def publish_image(self, href: str) -> tuple[str, Removal]:
        """Return a URL of an image, and the removal that withdraws it.

        Args:
            href: A file in the page's folder, or an absolute path.

        Raises:
            ConfigError: Like :meth:`image`.

        """
        url = self.publisher.publish_image(self.image_file(href))

        def undo() -> None:
            self.scope.discard(removal)
            self.publisher.withdraw_image(url)

        removal = Removal(undo)
        self.scope.add(removal)
        return url, removal

    def image_file(self, href: str) -> Path:
        """Return the path of an image, which may not exist.

        Args:
            href: A file in the page's folder, or an absolute path.

        Raises:
            ConfigError: If it lies outside the folder.

        """
        file = Path(href)
        if not file.is_absolute():
            file = self.entry.folder / file
            if not resolved(file).is_relative_to(self.entry.folder):
                raise ConfigError(f"{href!r} lies outside {self.entry.folder}")
        return file

    def notice(self, text: str) -> None:
        """Show a sentence to the viewer until it is dismissed."""
        self.channel.error(text)

    @property
    def speeds(self) -> tuple[float, float]:
        """The greatest speeds that the page asks for now, in m/s and rad/s.

        They are those of the module with active input; without active input, the lowest
        of all modules; zero without a module that drives.
        """
        return self._speeds.current

    def set_speeds(self, module: object, speed: float, rotation_speed: float) -> None:
        """Send the gate the greatest speeds of a module, in m/s and rad/s."""
        self._speeds.set(module, speed, rotation_speed)
        self._report_speeds()

    def set_driving(self, module: object, on: bool) -> None:
        """Set whether a module has active input; then its speeds alone count."""
        self._speeds.drive(module, on)
        self._report_speeds()

    def clear_speeds(self, module: object) -> None:
        """Remove a module that no longer drives."""
        self._speeds.clear(module)
        self._report_speeds()

    def move(self, robot: str, x: float, y: float, yaw: float) -> None:
        """Send a goal in the name of this page; see ``Robot.move``."""
        if self.on_move is not None:
            self.on_move(robot, x, y, yaw)

    def _report_speeds(self) -> None:
        if self.on_speeds is not None:
            self.on_speeds(*self.speeds)

    def listen(
        self,
        mount: int,
        element: Element,
        event: str,
        handler: Handler,
        *,
        role: Role = "operator",
        prevent: bool = False,
        stop: bool = False,
    ) -> Removal:
        """Call ``handler`` for an event of an element in this page only.

        It ends with the returned removal, the current scope or the page.
        """
        key = (mount, element.id, event)
        scope = current_scope()
        if scope is None:
            scope = self.scope
        listener = Listener(handler, scope, role, prevent=prevent, stop=stop)
        self._set_listening(key, (*self._listening.get(key, ()), listener))

        def undo() -> None:
            listener.forget()
            known = self._listening.get(key, ())
            self._set_listening(key, tuple(i for i in known if i is not listener))

        listener.removal = Removal(undo)
        scope.add(listener.removal)
        return listener.removal

    def _set_listening(self, key: ListenerKey, listeners: tuple[Listener, ...]) -> None:
        """Set the listeners of an event, and update the browser if needed."""
        flags = _flags(listeners)
        if flags != _flags(self._listening.get(key, ())):
            if flags is None:
                self.channel.unlisten(*key)
            else:
                prevent, stop = flags
                self.channel.listen(*key, prevent=prevent, stop=stop)
        if listeners:
            self._listening[key] = listeners
        else:
            self._listening.pop(key, None)

    def forget_mount(self, mount: int) -> None:
        """Remove all listeners of a mount."""
        for key in [key for key in self._listening if key[0] == mount]:
            for listener in self._listening.pop(key):
                listener.forget()

    def asset(self, file: str | Path) -> str:
        """Return the URL of an ES module or a style sheet.

        Args:
            file: The name of a file of WebMap, such as ``"features/drive/teleop.js"``,
                or a path.

        """
        return file if isinstance(file, str) else self.publisher.publish_file(file)

    def dispatch(self, mount: int, element: Element, event: Event) -> None:
        """Call the listeners: the element's own, then those of this page."""
        element.dispatch(event, self._failed, self._begin)
        for listener in self._listening.get((mount, element.id, event.kind), ()):
            listener.call(event, self._failed, self._begin)

    def _begin(self, work: Awaitable[Any]) -> None:
        begin(work, self._failed)

    def _failed(self, error: Exception) -> None:
        if isinstance(error, NotAllowed):
            self.notice(str(error))
            return
        log.error("a handler of %s failed", self.entry.path, exc_info=error)
        if not self.closed:
            self.notice(f"A handler failed: {type(error).__name__}: {error}")

    def close(self) -> None:
        """Close the page: destroy its contents and release its resources."""
        if self.closed:
            return
        self.closed = True
        for part in reversed(tuple(self.contents)):
            part.destroy()
        self.scope.close()
        for mount in {mount for mount, _, _ in self._listening}:
            self.forget_mount(mount)
        self.channel.unmount(self.mount)


def _flags(listeners: Sequence[Listener]) -> tuple[bool, bool] | None:
    """Return whether any prevents and any stops; None without listeners."""
    if not listeners:
        return None
    return any(i.prevent for i in listeners), any(i.stop for i in listeners)


_pages: "weakref.WeakValueDictionary[int, BasePage]" = weakref.WeakValueDictionary()


def page_of(container: Element) -> BasePage:
    """Return the page that an element belongs to.

    Raises:
        ConfigError: If it is on no page.

    """
    fragment = container.fragment
    page = None if fragment is None else _pages.get(fragment.id)
    if page is None:
        raise ConfigError(
            f"{container!r} is on no page: take the container of a map from "
            "page.element(id), or append it to such an element first"
        )
    return page
