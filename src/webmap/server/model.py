"""The open pages: where a socket, a viewer and a page function meet.

All of it lives in the model's thread but for :class:`Model`'s own methods, which the
web thread calls and which only hand over.
"""

import asyncio
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import Any

from webmap.core.page import PageEntry
from webmap.core.page_ports import Publisher
from webmap.core.refused import refusals
from webmap.core.runtime import Runtime
from webmap.server.page_host import PageHost, Speeds
from webmap.server.ports import Outbox
from webmap.server.viewer import Viewer


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
    """All open pages of this process.

    Args:
        runtime: The model's thread.
        pages: What is behind each path.
        publisher: Where the pages' files get URLs.
        max_pages: How many pages there are at most; of those that are kept for a
            viewer who may come back, the one that was lost first gives way.

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
            self._make_room()
            self._hosts[key] = host = PageHost(self, self.pages[key[0]], key, viewer)
            host.drive = self._drives.get(key[1:])
        return self._hosts[key]

    def forget(self, key: tuple[str, str, str], host: PageHost) -> None:
        """Note that a page has ended for good."""
        if self._hosts.get(key) is host:
            del self._hosts[key]

    def _make_room(self) -> None:
        """End those that were lost longest ago, if there are too many for one more."""
        lost = [host for host in self._hosts.values() if host.lost_at is not None]
        lost.sort(key=lambda host: host.lost_at or 0.0)
        for host in lost[: max(0, len(self._hosts) + 1 - self._max_pages)]:
            host.close()

    def close(self) -> None:
        """End every page."""
        for host in tuple(self._hosts.values()):
            host.close()

    def later(self, delay: float, fn: Callable[[], object]) -> asyncio.TimerHandle:
        """Call ``fn`` in the model's thread after ``delay`` seconds."""
        return asyncio.get_running_loop().call_later(delay, fn)

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
