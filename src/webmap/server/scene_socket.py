"""The ``/_webmap/scene`` sockets: the scene to the page, its events back.

A page sends its hello in the address of the socket, so that the first frame takes one
round trip less; other programs may send it as their first message.
"""

import logging
import time

from starlette.websockets import WebSocket

from webmap.core.base_page import PageEntry, Viewer
from webmap.core.page import Site
from webmap.server.open_pages import OpenPages
from webmap.server.outbox import BatchedCallsByLoop, FrameQueue
from webmap.server.page_socket import (
    BROKEN_RULE,
    COME_BACK,
    FAILED,
    FULL,
    SCENE,
    TOO_SOON,
    Opens,
    OpenSockets,
    PageSocket,
    accept,
    close,
    page_id_of,
)
from webmap.server.security import VIEWER

log = logging.getLogger("webmap.server")


def find_page(site: Site, path: str) -> PageEntry | None:
    """Return the page at a path, with or without the slash at its start."""
    return site.pages.get("/" + path.removeprefix("/"))


class SceneSockets:
    """The ``/_webmap/scene`` sockets of one application."""

    def __init__(
        self, site: Site, pages: OpenPages, calls: BatchedCallsByLoop, limit: int
    ) -> None:
        self._site = site
        self._pages = pages
        self._calls = calls
        self._open = OpenSockets(limit)
        self._opens = Opens(limit)

    async def serve(self, socket: WebSocket) -> None:
        """Serve one socket until it ends."""
        viewer: Viewer = socket.scope[VIEWER]
        page_id = page_id_of(socket.query_params)
        entry = find_page(self._site, socket.query_params.get("page", "/"))
        await accept(socket)
        if entry is None:
            await close(socket, BROKEN_RULE, "there is no page at this address")
            return
        if page_id is None:
            await close(socket, BROKEN_RULE, "id must be 1 to 64 letters, digits, -, _")
            return
        name = f"scene of {entry.path} for {viewer.name}"
        page_socket = PageSocket(
            socket, name, self._calls.of_this_loop(), SCENE, FrameQueue()
        )
        if not self._opens.may_open(viewer.id, time.monotonic()):
            await page_socket.refuse(COME_BACK, TOO_SOON)
            return
        async with self._open.holding((viewer.id, page_id), page_socket) as has_room:
            if has_room:
                hello = socket.query_params.get("hello")
                await self._carry(page_socket, entry.path, page_id, viewer, hello)
            else:
                await page_socket.refuse(COME_BACK, FULL)

    async def _carry(
        self,
        page_socket: PageSocket,
        path: str,
        page_id: str,
        viewer: Viewer,
        hello: str | None,
    ) -> None:
        try:
            handle = self._pages.open_scene(path, page_id, viewer, page_socket)
        except Exception:
            log.exception("the page %s could not be opened", path)
            await page_socket.refuse(
                FAILED, "the page could not be opened; see the log of WebMap"
            )
            return
        if hello is not None:
            handle.receive(hello)
        try:
            await page_socket.run(
                handle.receive, lambda why: self._pages.refused(viewer, why)
            )
        finally:
            handle.closed()
