"""The open pages: where a socket, a viewer and a page function meet.

All of it lives in the model's thread but for :class:`Model`'s own methods, which the
web thread calls and which only hand over.
"""

import asyncio
import inspect
import logging
import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import Any, Protocol

from webmap.core.page import Page, PageEntry, Publisher
from webmap.core.refused import refusals
from webmap.core.runtime import Runtime
from webmap.core.tasks import spawn
from webmap.core.view import Rect
from webmap.errors import WireError
from webmap.geometry import Affine
from webmap.scene.events import Event
from webmap.scope import Removal
from webmap.server.ports import Outbox
from webmap.server.viewer import Viewer
from webmap.wire.messages import (
    ElementEvent,
    Hello,
    ModuleMessage,
    ModuleReady,
    PageEvent,
    Trouble,
    ViewReport,
)
from webmap.wire.session import SceneSession

log = logging.getLogger("webmap.page")

SAME = (
    "x",
    "y",
    "world_x",
    "world_y",
    "key",
    "button",
    "delta",
    "shift",
    "ctrl",
    "alt",
    "meta",
    "value",
    "checked",
)
"""What an event of the scene has by the same names as a page's message."""

KEPT_FOR = 30.0
"""Seconds for which a page waits for its viewer to come back."""


class Speeds(Protocol):
    """A connection that drives, as far as a page's limits go."""

    def set_speeds(self, v: float, w: float) -> None:
        """Set the most that this connection's hands may ask for."""


class PageHost:
    """One page of one viewer, through losses of its socket and reloads."""

    def __init__(
        self, model: "Model", key: tuple[str, str, str], viewer: Viewer
    ) -> None:
        self.viewer = viewer
        self._model = model
        self._key = key
        self._entry: PageEntry = model.pages[key[0]]
        self._session = SceneSession()
        self._page: Page | None = None
        self._outbox: Outbox | None = None
        self._watching: Removal | None = None
        self._lost = 0
        self.drive: Speeds | None = None

    def __repr__(self) -> str:
        return f"<page {self._entry.path} of {self.viewer.name}>"

    # From the socket.

    def connected(self, outbox: Outbox) -> None:
        """Speak to this socket from now on, once it has said hello."""
        if self._outbox is not None:
            self._outbox.close("this page was opened again elsewhere")
        self._outbox = outbox
        self._stop_watching()

    def receive(self, outbox: Outbox, text: str) -> None:
        """Take one message of the page."""
        if outbox is not self._outbox:
            return
        try:
            events = self._session.receive(text)
        except WireError as error:
            log.warning("%r: %s", self, error)
            self._model.count_refused(self.viewer, f"page: {error}")
            return
        for event in events:
            self._hear(event)

    def _hear(self, event: PageEvent) -> None:
        match event:
            case Hello(containers=sizes):
                self._hello(sizes)
            case ElementEvent():
                self._element_event(event)
            case ViewReport():
                self._view_report(event)
            case ModuleReady(instance=instance):
                self._module_ready(instance)
            case ModuleMessage(instance=instance, data=data):
                self._module_message(instance, data)
            case Trouble(text=text):
                log.warning("%r: the page says: %s", self, text)

    def lost(self, outbox: Outbox) -> None:
        """Note that the socket is gone; the page is kept for a while."""
        if outbox is not self._outbox:
            return
        self._outbox = None
        self._stop_watching()
        self._lost += 1
        self._model.later(KEPT_FOR, self._give_up, self._lost)

    def tick(self, now: float) -> None:
        """Send what changed, if the page keeps up."""
        if self._outbox is not None:
            data = self._session.frame(time.monotonic())
            if data is not None:
                self._outbox.offer(data)

    def notice(self, text: str) -> None:
        """Show a sentence to the viewer until it is dismissed."""
        self._session.error(text)

    # From the page.

    def _hello(self, sizes: Mapping[str, tuple[float, float]]) -> None:
        self._session.restart()
        if self._page is None:
            self._open(sizes)
        self._stop_watching()
        self._watching = self._model.runtime.watch(self)

    def _view_report(self, report: ViewReport) -> None:
        r = report
        for map in self._page.maps if self._page else ():
            if map.root.id == r.map_element:
                tf = Affine(r.a, r.b, r.c, r.d, r.e, r.f)
                map.on_view_report(tf, Rect(r.left, r.top, r.width, r.height))

    def _module_ready(self, instance: int) -> None:
        for map in self._page.maps if self._page else ():
            map.on_module_ready(instance)

    def _module_message(self, instance: int, message: dict[str, Any]) -> None:
        for map in self._page.maps if self._page else ():
            map.on_module_message(instance, message)

    def _element_event(self, said: ElementEvent) -> None:
        page, element = self._page, self._session.element(said.mount, said.element)
        if page is None or element is None:
            return
        event = Event(
            kind=said.event,
            element=element,
            viewer=self.viewer,
            map=next((map for map in page.maps if map.shows(said.mount)), None),
            **{name: getattr(said, name) for name in SAME},
        )
        page.dispatch(said.mount, element, event)

    def close(self) -> None:
        """End the page for good."""
        self._stop_watching()
        self._model.forget(self._key, self)
        if self._page is not None:
            self._page.close()
            self._page = None
        if self._outbox is not None:
            self._outbox.close("the page was closed")
            self._outbox = None

    def tell_speeds(self) -> None:
        """Tell the gate how fast this page's hands may drive."""
        if self.drive is not None and self._page is not None:
            self.drive.set_speeds(*self._page.speeds)

    def _open(self, sizes: Mapping[str, tuple[float, float]]) -> None:
        page = self._page = Page(
            self._entry, self._session, self.viewer, self._model.publisher, sizes
        )
        page.on_speeds = lambda v, w: self.tell_speeds()
        try:
            with page.scope.active():
                result = self._entry.function(page)
                if inspect.isawaitable(result):
                    spawn(self._finish(page, result))
        except Exception as error:
            self._failed(error)
        self.tell_speeds()

    async def _finish(self, page: Page, result: Any) -> None:
        try:
            with page.scope.active():
                await result
        except Exception as error:
            self._failed(error)

    def _failed(self, error: Exception) -> None:
        log.error("%r: the page function failed", self, exc_info=error)
        self._session.error(
            f"This page could not be built: {type(error).__name__}: {error}"
        )

    def _give_up(self, lost: int) -> None:
        if self._outbox is None and self._lost == lost:
            self.close()

    def _stop_watching(self) -> None:
        if self._watching is not None:
            self._watching.remove()
            self._watching = None


class Handle:
    """The web thread's end of one scene socket; it only hands over."""

    def __init__(
        self, model: "Model", key: tuple[str, str, str], viewer: Viewer, outbox: Outbox
    ) -> None:
        self._model = model
        self._outbox = outbox
        self._host: PageHost | None = None
        model.runtime.call(self._open, key, viewer)

    def receive(self, text: str) -> None:
        """Hand one message over."""
        self._model.runtime.call(self._received, text)

    def closed(self) -> None:
        """Hand over that the socket is gone."""
        if self._model.runtime.running:
            self._model.runtime.call(self._lost)

    def _open(self, key: tuple[str, str, str], viewer: Viewer) -> None:
        self._host = self._model.host(key, viewer)
        self._host.connected(self._outbox)

    def _received(self, text: str) -> None:
        if self._host is not None:
            self._host.receive(self._outbox, text)

    def _lost(self) -> None:
        if self._host is not None:
            self._host.lost(self._outbox)


class Model:
    """All open pages of this process."""

    def __init__(
        self,
        runtime: Runtime,
        pages: Mapping[str, PageEntry],
        publisher: Publisher,
    ) -> None:
        self.runtime = runtime
        self.pages = pages
        self.publisher = publisher
        self._hosts: dict[tuple[str, str, str], PageHost] = {}
        self._drives: dict[tuple[str, str], Speeds] = {}

    # From the web thread.

    def open_scene(
        self, entry_path: str, page_id: str, viewer: Viewer, outbox: Outbox
    ) -> Handle:
        """Take up a page whose socket has opened; return without waiting."""
        return Handle(self, (entry_path, page_id, viewer.id), viewer, outbox)

    def drive_opened(self, page_id: str, viewer: Viewer, connection: Any) -> None:
        """Note by which connection a page drives, to set its speeds."""
        self.runtime.call(self._drive_opened, (page_id, viewer.id), connection)

    def drive_closed(self, page_id: str, viewer: Viewer, connection: Any) -> None:
        """Note that this connection is gone; another may have replaced it before."""
        if self.runtime.running:
            self.runtime.call(self._drive_closed, (page_id, viewer.id), connection)

    def refused(self, viewer: Viewer, why: str) -> None:
        """Count a message whose socket is ended for it."""
        if self.runtime.running:
            self.runtime.call(self.count_refused, viewer, f"socket: {why}")

    # In the model's thread.

    def count_refused(self, viewer: Viewer, last: str) -> None:
        """Count a message of a page that was not taken."""
        refusals.note(viewer.name, 1, last, datetime.now(UTC))

    def host(self, key: tuple[str, str, str], viewer: Viewer) -> PageHost:
        """Return the page of that key: the one that was kept, or a new one."""
        if key not in self._hosts:
            self._hosts[key] = host = PageHost(self, key, viewer)
            host.drive = self._drives.get(key[1:])
        return self._hosts[key]

    def forget(self, key: tuple[str, str, str], host: PageHost) -> None:
        """Note that a page has ended for good."""
        if self._hosts.get(key) is host:
            del self._hosts[key]

    def close(self) -> None:
        """End every page."""
        for host in tuple(self._hosts.values()):
            host.close()

    def later(self, delay: float, fn: Callable[..., object], *args: Any) -> None:
        """Call ``fn`` in the model's thread after ``delay`` seconds."""
        asyncio.get_running_loop().call_later(delay, fn, *args)

    def _drive_opened(self, key: tuple[str, str], connection: Speeds) -> None:
        self._drives[key] = connection
        self._tell_drive(key, connection)

    def _drive_closed(self, key: tuple[str, str], connection: Speeds) -> None:
        if self._drives.get(key) is connection:
            del self._drives[key]
            self._tell_drive(key, None)

    def _tell_drive(self, key: tuple[str, str], connection: Speeds | None) -> None:
        for host_key, host in self._hosts.items():
            if host_key[1:] == key:
                host.drive = connection
                host.tell_speeds()
