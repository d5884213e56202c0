"""One page of one viewer, through losses of its socket and reloads."""

import asyncio
import inspect
import logging
import time
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Protocol

from webmap.core.page import Page, PageEntry
from webmap.core.page_ports import Publisher
from webmap.core.runtime import Runtime
from webmap.core.tasks import begin
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


class Keeper(Protocol):
    """Who keeps the pages, as far as one of them asks."""

    @property
    def runtime(self) -> Runtime:
        """What ticks a page that has a socket."""

    @property
    def publisher(self) -> Publisher:
        """Where its files get URLs."""

    def count_refused(self, viewer: Viewer, last: str) -> None:
        """Count a message of a page that was not taken."""

    def forget(self, key: tuple[str, str, str], host: "PageHost") -> None:
        """Note that a page has ended for good."""

    def later(self, delay: float, fn: Callable[[], object]) -> asyncio.TimerHandle:
        """Call ``fn`` in the model's thread after ``delay`` seconds."""


class PageHost:
    """One page of one viewer, through losses of its socket and reloads."""

    def __init__(
        self,
        keeper: Keeper,
        entry: PageEntry,
        key: tuple[str, str, str],
        viewer: Viewer,
    ) -> None:
        self.viewer = viewer
        self._keeper = keeper
        self._entry = entry
        self._key = key
        self._session = SceneSession()
        self._page: Page | None = None
        self._outbox: Outbox | None = None
        self._watching: Removal | None = None
        self._giving_up: asyncio.TimerHandle | None = None
        self.lost_at: float | None = None
        """When its socket was lost, on the monotonic clock; None while it has one."""
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
        self._stay()

    def receive(self, outbox: Outbox, text: str) -> None:
        """Take one message of the page."""
        if outbox is not self._outbox:
            return
        try:
            events = self._session.receive(text)
        except WireError as error:
            log.warning("%r: %s", self, error)
            self._keeper.count_refused(self.viewer, f"page: {error}")
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
        self.lost_at = time.monotonic()
        self._giving_up = self._keeper.later(KEPT_FOR, self.close)

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
        self._watching = self._keeper.runtime.watch(self)

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
        self._stay()
        self._keeper.forget(self._key, self)
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
            self._entry, self._session, self.viewer, self._keeper.publisher, sizes
        )
        page.on_speeds = lambda v, w: self.tell_speeds()
        try:
            with page.scope.active():
                result = self._entry.function(page)
                if inspect.isawaitable(result):
                    begin(_then_complete(result, page), self._failed)
                else:
                    page.complete()
        except Exception as error:
            self._failed(error)
        self.tell_speeds()

    def _failed(self, error: Exception) -> None:
        if self._page is None:  # nobody looks any more, and it may well be for that
            log.info("%r was closed before it was built: %s", self, error)
            return
        log.error("%r: the page function failed", self, exc_info=error)
        self._session.error(
            f"This page could not be built: {type(error).__name__}: {error}"
        )

    def _stay(self) -> None:
        """Give up no more; a timer would hold what has ended for as long as it runs."""
        self.lost_at = None
        if self._giving_up is not None:
            self._giving_up.cancel()
            self._giving_up = None

    def _stop_watching(self) -> None:
        if self._watching is not None:
            self._watching.remove()
            self._watching = None


async def _then_complete(building: Awaitable[Any], page: Page) -> None:
    await building
    page.complete()
