"""The shell of ``/_webmap/scene``: the picture out, what hands do back in."""

import logging

from starlette.websockets import WebSocket

from webmap.server.bounds import SCENE
from webmap.server.hop import Hops
from webmap.server.line import BROKEN_RULE, FAILED, Line, accept, close
from webmap.server.paths import find_page, page_id_of
from webmap.server.ports import Model, Site
from webmap.server.queues import FrameQueue
from webmap.server.seats import Seats
from webmap.server.security import VIEWER
from webmap.server.viewer import Viewer

log = logging.getLogger("webmap.server")


class SceneOutbox:
    """The way of finished frames to one page; callable from any thread."""

    __slots__ = ("_line",)

    def __init__(self, line: Line) -> None:
        self._line = line

    def offer(self, data: bytes) -> None:
        """Send one binary frame soon; nothing happens once the page is gone."""
        self._line.offer(data)

    def close(self, reason: str) -> None:
        """End the socket and tell the page why."""
        self._line.end(FAILED, reason)


class SceneSockets:
    """The ``/_webmap/scene`` sockets of one application."""

    def __init__(self, site: Site, model: Model, hops: Hops, limit: int) -> None:
        self._site = site
        self._model = model
        self._hops = hops
        self._seats: Seats[Line] = Seats(limit)

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
        line = Line(socket, name, self._hops.here(), SCENE, FrameQueue())
        async with self._seats.taken((viewer.id, page_id), line) as seated:
            if seated:
                await self._carry(line, entry.path, page_id, viewer)
            else:
                await line.refuse_full()

    async def _carry(self, line: Line, path: str, page_id: str, viewer: Viewer) -> None:
        try:
            handle = self._model.open_scene(path, page_id, viewer, SceneOutbox(line))
        except Exception:
            log.exception("the page %s could not be opened", path)
            await line.refuse(FAILED, "the page could not be opened; the log says why")
            return
        try:
            await line.run(handle.receive, lambda why: self._model.refused(viewer, why))
        finally:
            handle.closed()
