"""The open pages: they connect a socket, a viewer and a page function.

The web thread calls :class:`SceneHandle` and a few methods of :class:`OpenPages`, which
only pass data to the model's thread. Everything else runs in the model's thread.
"""

import asyncio
import gc
import inspect
import logging
import time
from collections.abc import Awaitable, Mapping
from datetime import UTC, datetime
from typing import Any, Protocol

from webmap.base.errors import MotionError, WireError
from webmap.base.geometry import Affine
from webmap.base.scope import Removal
from webmap.base.tasks import begin
from webmap.core.base_page import PageEntry
from webmap.core.map import Map
from webmap.core.operators import Viewer
from webmap.core.page import Page
from webmap.core.pictures import Publisher
from webmap.core.refusals import refusals
from webmap.core.runtime import Runtime
from webmap.core.visible_robot import robots
from webmap.core.world_view import Rect
from webmap.scene.element import Event
from webmap.scene.wire.messages import (
    ElementEvent,
    ModuleMessage,
    ModuleReady,
    PageEvent,
    PageHello,
    Trouble,
    ViewReport,
)
from webmap.scene.wire.session import SceneSession
from webmap.server.page_socket import FAILED

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
"""The attributes that an event of the scene shares with a page's message."""

DONE = ("click", "change")
"""The events whose answer the operator waits for: the page gets a frame at once."""

PageKey = tuple[str, str, str]
"""The path of a page, the page's own identifier, and its viewer's."""

CLOSED = 10
"""Closed pages after which a collection of garbage looks at all pages."""

CLOSED_AT_MOST = 500
"""The same while somebody has control of a robot, whom the collection would stop."""

KEPT_FOR = 30.0
"""Seconds for which a page is kept for its viewer after its socket was lost."""


class GateConnection(Protocol):
    """One page's socket at the gates."""

    def receive(self, text: str | bytes) -> None:
        """Pass a frame of the page to the gate, valid or not."""

    def set_speeds(self, v: float, w: float) -> None:
        """Set the page's own speed limits, in m/s and rad/s."""

    def move(self, robot: str, x: float, y: float, yaw: float) -> None:
        """Send a goal in the name of the page."""

    def rename(self, name: str) -> None:
        """Show the person at the page under another name from now on."""

    def close(self) -> None:
        """Remove the page, which has closed; the robots that it drove stop."""


class SceneSocket(Protocol):
    """What carries the scene to one page: a WebSocket, or a notebook's connection."""

    def offer(self, item: bytes | str) -> None:
        """Send a frame soon."""

    def end(self, code: int, reason: str) -> None:
        """Close the connection with a reason."""


class PageHost:
    """One page of one viewer, kept when its socket is lost or the page is reloaded."""

    def __init__(
        self,
        pages: "OpenPages",
        entry: PageEntry,
        key: PageKey,
        viewer: Viewer,
    ) -> None:
        self.viewer = viewer
        self._pages = pages
        self._entry = entry
        self._key = key
        self._session = SceneSession()
        self._page: Page | None = None
        self._socket: SceneSocket | None = None
        self._watching: Removal | None = None
        self._giving_up: asyncio.TimerHandle | None = None
        self.lost_at: float | None = None
        """When its socket was lost, on the monotonic clock; None while it has one."""
        self.drive: GateConnection | None = None

    def __repr__(self) -> str:
        return f"<page {self._entry.path} of {self.viewer.operator.logged}>"

    # From the socket.

    def connected(self, socket: SceneSocket) -> None:
        """Use this socket from now on, once it has sent its hello."""
        if self._socket is not None:
            self._socket.end(FAILED, "this page was opened again in another tab")
        self._socket = socket
        self._stop_watching()
        self._stay()

    def receive(self, socket: SceneSocket, text: str) -> None:
        """Process one message of the page."""
        if socket is not self._socket:
            return
        try:
            events = self._session.receive(text)
        except WireError as error:
            log.warning("%r: %s", self, error)
            self._pages.count_refused(self.viewer, f"page: {error}")
            return
        for event in events:
            self._receive(event)

    def _receive(self, event: PageEvent) -> None:
        match event:
            case PageHello():
                self._hello(event)
            case ElementEvent():
                self._element_event(event)
            case ViewReport():
                self._view_report(event)
            case ModuleReady(instance=instance):
                for map in self._maps:
                    map.on_module_ready(instance)
            case ModuleMessage(instance=instance, data=data):
                for map in self._maps:
                    map.on_module_message(instance, data)
            case Trouble(text=text):
                log.warning("%r: the page reports: %s", self, text)

    def lost(self, socket: SceneSocket) -> None:
        """Set that the socket was lost; the page is kept for a while."""
        if socket is not self._socket:
            return
        self._socket = None
        self._stop_watching()
        if self._page is None:  # nothing to keep, and nothing to build any more
            self.close()
            return
        self.lost_at = time.monotonic()
        self._giving_up = asyncio.get_running_loop().call_later(
            self._pages.kept_for, self.close
        )

    def tick(self, now: float) -> bool:
        """Send the changes, if the page keeps up; return whether there were some."""
        data = None if self._socket is None else self._session.frame(now)
        if self._socket is None or data is None:
            return False
        self._socket.offer(data)
        return True

    def notice(self, text: str) -> None:
        """Show a sentence to the viewer until it is dismissed."""
        self._session.error(text)

    # From the page.

    def _hello(self, hello: PageHello) -> None:
        self._session.restart()
        if self._page is None:
            self._pages.build_soon(self, hello)
        else:
            self._show()

    def build(self, hello: PageHello) -> None:
        """Call the page's function, and send the first frame at once."""
        self._open(hello)
        self._show()

    def _show(self) -> None:
        self._stop_watching()
        self._watching = self._pages.runtime.watch(self)
        # The viewer sees nothing yet, so this frame waits for no tick.
        self.tick(time.monotonic())

    def _view_report(self, report: ViewReport) -> None:
        r = report
        for map in self._maps:
            if map.root.id == r.map_element:
                tf = Affine(r.a, r.b, r.c, r.d, r.e, r.f)
                map.on_view_report(tf, Rect(r.left, r.top, r.width, r.height))

    @property
    def _maps(self) -> list[Map]:
        return self._page.maps if self._page else []

    def _element_event(self, report: ElementEvent) -> None:
        page, element = self._page, self._session.element(report.mount, report.element)
        if page is None or element is None:
            return
        event = Event(
            kind=report.event,
            element=element,
            viewer=self.viewer,
            page=page,
            map=next((map for map in page.maps if map.shows(report.mount)), None),
            **{name: getattr(report, name) for name in SAME},
        )
        page.dispatch(report.mount, element, event)
        if report.event in DONE:
            self.tick(time.monotonic())

    def close(self) -> None:
        """Forget the page and what its function made; its socket is closed."""
        self._stop_watching()
        self._stay()
        self._pages.forget(self._key, self, built=self._page is not None)
        if self._page is not None:
            self._page.close()
            self._page = None
        if self._socket is not None:
            self._socket.end(FAILED, "the page was closed")
            self._socket = None

    def send_speeds(self) -> None:
        """Send the gate the greatest speeds that this page may ask for."""
        if self.drive is not None and self._page is not None:
            self.drive.set_speeds(*self._page.speeds)

    def _move(self, robot: str, x: float, y: float, yaw: float) -> None:
        if self.drive is None:
            raise MotionError("the goal was not sent: the page is not connected")
        self.drive.move(robot, x, y, yaw)

    def _open(self, hello: PageHello) -> None:
        page = self._page = Page(
            self._entry,
            self._session,
            self.viewer,
            self._pages.publisher,
            hello.containers,
            (hello.width, hello.height),
        )
        page.on_speeds = lambda v, w: self.send_speeds()
        page.on_move = self._move
        try:
            with page.scope.active():
                result = self._entry.function(page)
                if inspect.isawaitable(result):
                    begin(_then_complete(result, page), self._failed)
                else:
                    page.complete()
        except Exception as error:
            self._failed(error)
        self.send_speeds()
        self._pages.built()

    def _failed(self, error: Exception) -> None:
        if self._page is None:  # the viewer is gone, which may be the cause
            log.info("%r was closed before it was built: %s", self, error)
            return
        log.error("%r: the page function failed", self, exc_info=error)
        self._session.error(
            f"This page could not be built: {type(error).__name__}: {error}"
        )

    def _stay(self) -> None:
        """Keep the page; a running timer would keep a closed one in memory."""
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


class SceneHandle:
    """The web thread's end of one scene socket; it only passes messages on."""

    def __init__(
        self, pages: "OpenPages", key: PageKey, viewer: Viewer, socket: SceneSocket
    ) -> None:
        self._pages = pages
        self._socket = socket
        self._host: PageHost | None = None
        pages.runtime.call(self._open, key, viewer)

    def receive(self, text: str) -> None:
        """Pass one message to the model's thread."""
        self._pages.runtime.call(self._received, text)

    def closed(self) -> None:
        """Report to the model's thread that the socket was lost."""
        if self._pages.runtime.running:
            self._pages.runtime.call(self._lost)

    def _open(self, key: PageKey, viewer: Viewer) -> None:
        self._host = self._pages.host(key, viewer)
        self._host.connected(self._socket)

    def _received(self, text: str) -> None:
        if self._host is not None:
            self._host.receive(self._socket, text)

    def _lost(self) -> None:
        if self._host is not None:
            self._host.lost(self._socket)


class OpenPages:
    """All open pages of this process.

    Args:
        runtime: The model's thread.
        pages: The page entry of each path.
        publisher: Gives the pages' files URLs.
        max_pages: The greatest number of pages. Of those that are kept for a viewer who
            may return, the page that was lost first is closed for a new page.

    """

    def __init__(
        self,
        runtime: Runtime,
        pages: Mapping[str, PageEntry],
        publisher: Publisher,
        *,
        max_pages: int,
    ) -> None:
        self.runtime = runtime
        self.pages = pages
        self.publisher = publisher
        self._max_pages = max_pages
        self._hosts: dict[PageKey, PageHost] = {}
        self._unbuilt: dict[str, dict[PageHost, PageHello]] = {}
        """The pages to build, by viewer; the viewer whose turn is next comes first."""
        self._closed = 0
        self._drives: dict[tuple[str, str], GateConnection] = {}

    @property
    def kept_for(self) -> float:
        """Seconds for which a page is kept whose socket was lost."""
        return KEPT_FOR

    # From the web thread.

    def open_scene(
        self, entry_path: str, page_id: str, viewer: Viewer, socket: SceneSocket
    ) -> SceneHandle:
        """Open a page whose socket was accepted; return without waiting."""
        return SceneHandle(self, (entry_path, page_id, viewer.id), viewer, socket)

    def drive_opened(
        self, page_id: str, viewer: Viewer, connection: GateConnection
    ) -> None:
        """Set the connection by which a page drives, to set its speeds."""
        self.runtime.call(self._drive_opened, (page_id, viewer.id), connection)

    def drive_closed(
        self, page_id: str, viewer: Viewer, connection: GateConnection
    ) -> None:
        """Remove a connection that has ended, unless another has replaced it."""
        if self.runtime.running:
            self.runtime.call(self._drive_closed, (page_id, viewer.id), connection)

    def refused(self, viewer: Viewer, why: str) -> None:
        """Count a refused message that ended its socket."""
        if self.runtime.running:
            self.runtime.call(self.count_refused, viewer, f"socket: {why}")

    # In the model's thread.

    def count_refused(self, viewer: Viewer, last: str) -> None:
        """Add a refused message to the problems of the system, with its reason."""
        refusals.note(str(viewer.operator), 1, last, datetime.now(UTC))

    def host(self, key: PageKey, viewer: Viewer) -> PageHost:
        """Return the page of that key: the kept one, or a new one."""
        kept = self._hosts.get(key)
        if kept is not None and kept.viewer != viewer:  # with other rights
            kept.close()
        if key not in self._hosts:
            self._make_room()
            self._hosts[key] = host = PageHost(self, self.pages[key[0]], key, viewer)
            host.drive = self._drives.get(key[1:])
        return self._hosts[key]

    def forget(self, key: PageKey, host: PageHost, *, built: bool) -> None:
        """Remove a page that was closed, and note whether it had been built."""
        if self._hosts.get(key) is host:
            del self._hosts[key]
        waiting = self._unbuilt.get(host.viewer.id, {})
        if waiting.pop(host, None) is not None and not waiting:
            del self._unbuilt[host.viewer.id]
        self._closed += built

    def build_soon(self, host: PageHost, hello: PageHello) -> None:
        """Build a page when it is the turn of its viewer.

        One page is built at a time, and the viewers take turns. Between two pages the
        thread does everything else, so that pages that have closed are not built.
        """
        if not self._unbuilt:
            asyncio.get_running_loop().call_soon(self._build_next)
        self._unbuilt.setdefault(host.viewer.id, {})[host] = hello

    def _build_next(self) -> None:
        if not self._unbuilt:
            return
        viewer = next(iter(self._unbuilt))
        waiting = self._unbuilt.pop(viewer)
        host = next(iter(waiting))
        hello = waiting.pop(host)
        if waiting:
            self._unbuilt[viewer] = waiting  # now the last
        if self._unbuilt:
            asyncio.get_running_loop().call_soon(self._build_next)
        # The objects of a page would make a collection due, which looks at all robots.
        self.freeze()
        host.build(hello)

    def built(self) -> None:
        """Except the objects of all pages from collections of garbage.

        A collection that looks at hundreds of pages stops every thread for half a
        second, and the gate stops the robots of a display after half of that. What
        remains of closed pages may be in cycles, so it is collected now and then, if
        possible while nobody drives.
        """
        driven = any(r.report and r.report.holder for r in list(robots.values()))
        if self._closed >= (CLOSED_AT_MOST if driven else CLOSED):
            self._closed = 0
            gc.unfreeze()
            gc.collect()
        self.freeze()

    def freeze(self) -> None:
        """Except all present objects from collections of garbage."""
        gc.freeze()

    def _make_room(self) -> None:
        """Close the pages that were lost first, if there are too many for one more."""
        lost = [host for host in self._hosts.values() if host.lost_at is not None]
        lost.sort(key=lambda host: host.lost_at or 0.0)
        for host in lost[: max(0, len(self._hosts) + 1 - self._max_pages)]:
            host.close()

    def close(self) -> None:
        """Close every page for good, without the wait for its viewer."""
        for host in tuple(self._hosts.values()):
            host.close()

    def _drive_opened(self, key: tuple[str, str], connection: GateConnection) -> None:
        self._drives[key] = connection
        self._set_drive(key, connection)

    def _drive_closed(self, key: tuple[str, str], connection: GateConnection) -> None:
        if self._drives.get(key) is connection:
            del self._drives[key]
            self._set_drive(key, None)

    def _set_drive(
        self, key: tuple[str, str], connection: GateConnection | None
    ) -> None:
        for host_key, host in self._hosts.items():
            if host_key[1:] == key:
                host.drive = connection
                host.send_speeds()
