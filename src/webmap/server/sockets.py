"""The sockets of a page: two, and one for each video that it shows.

``/_webmap/scene`` carries the scene to the page, and the page's events back. A page
sends its hello in the address of the socket, so that the first frame takes one round
trip less; other programs may send it as their first message.

``/_webmap/drive`` carries commands to the gate, and the gate's messages to the page. It
is a socket of its own, so that no large message delays a command. The page's messages
go to the gate unread; only the gate decides. A page beyond the limit can only stop:
STOP is never refused for lack of room.

``/_webmap/video/TAG`` carries one video. A page got the tag over ``/scene``, because it
shows the camera. The page answers each picture with the number of those that it has
received, so that a late page skips to the next key picture.
"""

import logging
import secrets
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from starlette.websockets import WebSocket

from webmap.base.roles import Role
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer, operators
from webmap.core.page import Site
from webmap.core.pictures import Viewing, videos
from webmap.core.shift_log import shift_log
from webmap.gate.commands import Refusal as InvalidCommand
from webmap.gate.commands import begins_like_stop, op_of, parse, stop_in
from webmap.gate.display.pages import refused_text
from webmap.gate.protocol import Identity, Refused
from webmap.server.open_pages import GateConnection, OpenPages
from webmap.server.origins import ip_of
from webmap.server.outbox import (
    BatchedCallsByLoop,
    DriveQueue,
    FrameQueue,
    VideoQueue,
)
from webmap.server.page_socket import (
    BROKEN_RULE,
    COME_BACK,
    DRIVE,
    FAILED,
    FULL,
    SCENE,
    TOO_SOON,
    VIDEO,
    Opens,
    OpenSockets,
    PageSocket,
    accept,
    close,
    page_id_of,
)
from webmap.server.security import VIEWER

log = logging.getLogger("webmap.server")


SIGNED_OUT = "you are not signed in any more"


def find_page(site: Site, path: str) -> PageEntry | None:
    """Return the page at a path, with or without the slash at its start."""
    return site.pages.get("/" + path.removeprefix("/"))


def place_of(socket: WebSocket) -> str:
    """Return where the browser of a socket is, for people; empty if a proxy hides it.

    A browser on this machine is named as seen from elsewhere: "this computer" would be
    the computer of whoever reads it.
    """
    host = socket.client.host if socket.client else ""
    address = ip_of(host)
    if address is None:  # such as a Unix socket
        return ""
    if not address.is_loopback:
        return str(address)
    proxied = "x-forwarded-for" in socket.headers or "forwarded" in socket.headers
    return "" if proxied else "WebMap's computer"


class PageSockets:
    """The sockets of one kind of one application.

    Args:
        calls: Calls functions in the loop of the sockets.
        limit: The greatest number of open sockets.

    """

    def __init__(self, calls: BatchedCallsByLoop, limit: int) -> None:
        self._calls = calls
        self.open = OpenSockets(limit)
        """Those that are open."""

    def end_unless(self, lasts: Callable[[str], object]) -> None:
        """Close the sockets of the viewers whose session has ended."""
        self.open.end_unless(lasts, SIGNED_OUT)


class SceneSockets(PageSockets):
    """The ``/_webmap/scene`` sockets of one application."""

    def __init__(
        self, site: Site, pages: OpenPages, calls: BatchedCallsByLoop, limit: int
    ) -> None:
        super().__init__(calls, limit)
        self._site = site
        self._pages = pages
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
        name = f"scene of {entry.path} for {viewer.operator.logged}"
        page_socket = PageSocket(
            socket, name, self._calls.of_this_loop(), SCENE, FrameQueue()
        )
        if not self._opens.may_open(viewer.id, time.monotonic()):
            await page_socket.refuse(COME_BACK, TOO_SOON)
            return
        async with self.open.holding((viewer.id, page_id), page_socket) as has_room:
            if has_room:
                hello = socket.query_params.get("hello")
                with operators.present(viewer, place_of(socket)):
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


MOST_VIDEOS = 8
"""The greatest number of videos for each page that may be open, on average."""

VIDEO_OVER = "this video has ended"


class VideoSockets(PageSockets):
    """The ``/_webmap/video/TAG`` sockets of one application."""

    def __init__(self, calls: BatchedCallsByLoop, limit: int) -> None:
        super().__init__(calls, MOST_VIDEOS * limit)

    async def serve(self, socket: WebSocket) -> None:
        """Serve one socket until it ends."""
        viewer: Viewer = socket.scope[VIEWER]
        stream = videos.get(socket.path_params["tag"])
        await accept(socket)
        if stream is None:
            await close(socket, BROKEN_RULE, VIDEO_OVER)
            return
        queue = VideoQueue()
        name = f"video for {viewer.operator.logged}"
        page_socket = PageSocket(socket, name, self._calls.of_this_loop(), VIDEO, queue)

        def answered(text: str) -> None:
            queue.answer(text)
            page_socket.go_on()

        key = (viewer.id, secrets.token_hex(8))
        async with self.open.holding(key, page_socket) as has_room:
            if not has_room:
                await page_socket.refuse(COME_BACK, "too many open videos")
                return
            end = partial(page_socket.end, BROKEN_RULE, VIDEO_OVER)
            leave = stream.join(Viewing(page_socket.offer, end))
            try:
                await page_socket.run(
                    answered, lambda why: log.warning("%s: %s", name, why)
                )
            finally:
                leave.remove()


ConnectToGate = Callable[
    [
        str,
        Role,
        Callable[[str], None],
        Callable[[str], None],
        Identity,
        Callable[[str], bool] | None,
    ],
    GateConnection,
]
"""Opens a connection to the gate for a viewer's name, role and identity. Two callbacks
send to the page and close its socket, and one, unless the viewer may drive every robot,
returns whether it may drive this one; they may be called from any thread."""

MOST_STOP_ONLY = 32
"""The greatest number of pages that can only stop; each new one gets a place."""

NO_PLACE = "too many open pages: this page can only stop robots"

MOST_LAST_STOPS = 60
"""The greatest number of STOPs that are served for a disconnected page: those of one
second."""


class DriveSockets(PageSockets):
    """The ``/_webmap/drive`` sockets of one application."""

    def __init__(
        self,
        pages: OpenPages,
        connect_to_gate: ConnectToGate,
        calls: BatchedCallsByLoop,
        limit: int,
    ) -> None:
        super().__init__(calls, limit)
        self._pages = pages
        self._connect_to_gate = connect_to_gate
        self._stop_only = OpenSockets(MOST_STOP_ONLY, always=True)

    def end_unless(self, lasts: Callable[[str], object]) -> None:
        """Close the sockets of the viewers whose session has ended: robots stop."""
        super().end_unless(lasts)
        self._stop_only.end_unless(lasts, SIGNED_OUT)

    async def serve(self, socket: WebSocket) -> None:
        """Serve one socket until it ends."""
        viewer: Viewer = socket.scope[VIEWER]
        # Without an id it can still drive, as a page of its own.
        named = "id" in socket.query_params
        page_id = page_id_of(socket.query_params) if named else secrets.token_hex(8)
        await accept(socket)
        if page_id is None:
            await close(socket, BROKEN_RULE, "id must be 1 to 64 letters, digits, -, _")
            return
        name = f"drive for {viewer.operator.logged}"
        page_socket = PageSocket(
            socket, name, self._calls.of_this_loop(), DRIVE, DriveQueue()
        )
        key = (viewer.id, page_id)
        place = place_of(socket)
        async with self.open.holding(key, page_socket) as has_room:
            if has_room:
                with operators.present(viewer, place):
                    await self._carry(page_socket, page_id, viewer, limited=named)
        if not has_room:
            viewer = replace(viewer, role="viewer")
            async with self._stop_only.holding(key, page_socket):
                with operators.present(viewer, place):
                    await self._carry(page_socket, page_id, viewer, stops_only=True)
        elif not self.open.full:
            self._stop_only.end_oldest("there is a place now: connect again")

    async def _carry(
        self,
        page_socket: PageSocket,
        page_id: str,
        viewer: Viewer,
        *,
        limited: bool = True,
        stops_only: bool = False,
    ) -> None:
        try:
            connection = self._connect(page_socket, page_id, viewer)
            if limited:
                # Until the model, which may be busy, has set the page's speeds.
                connection.set_speeds(0.0, 0.0)
        except Exception:
            log.exception("%s cannot reach the gate", viewer.operator.logged)
            await page_socket.refuse(
                FAILED, "no connection to the gate; see the log of WebMap"
            )
            return
        by = viewer.operator
        shift_log.note("page", "opened a page", person=by, role=viewer.role)
        try:
            self._pages.drive_opened(page_id, viewer, connection)

            last_stops = iter(range(MOST_LAST_STOPS))

            def receive(message: str) -> None:
                refusal = _unless_stop(message) if stops_only else None
                if refusal is None:
                    connection.receive(message)
                else:
                    page_socket.offer(refused_text(refusal))

            def rest(message: str | bytes) -> None:
                # A STOP of a disconnected page is still served (S10).
                if isinstance(message, str):
                    data = message.encode(errors="replace")
                else:
                    data = message
                if begins_like_stop(data) and next(last_stops, None) is not None:
                    connection.receive(message)

            with operators.following(viewer, connection):
                await page_socket.run(
                    receive, lambda why: self._pages.refused(viewer, why), rest
                )
        finally:
            # The gate first: the connection's leases end with it, and robots stop.
            connection.close()
            self._pages.drive_closed(page_id, viewer, connection)
            text = f"left a page: {page_socket.cause}"
            shift_log.note("page", text, person=viewer.operator)

    def _connect(
        self, page_socket: PageSocket, page_id: str, viewer: Viewer
    ) -> GateConnection:
        def close(reason: str) -> None:
            page_socket.end(BROKEN_RULE, reason)

        return self._connect_to_gate(
            viewer.operator.label,
            viewer.role,
            page_socket.offer,
            close,
            operators.identity(viewer, page_id),
            None if "*" in viewer.robots else viewer.may_drive,
        )


def _unless_stop(message: str) -> Refused | None:
    """Return the refusal of a message of a page without a place, unless it stops."""
    data = message.encode(errors="replace")
    if stop_in(data) is not None:
        return None
    try:
        command = parse(data)
    except InvalidCommand:
        return Refused("", None, "command", NO_PLACE)
    return Refused("", command.robot, op_of(command), NO_PLACE)
