"""The ``/_webmap/drive`` sockets: commands to the gate, its messages to the page.

It is a socket of its own, so that no large message delays a command. The page's
messages go to the gate unread; only the gate decides.
"""

import logging
import secrets
from collections.abc import Callable

from starlette.websockets import WebSocket

from webmap.core.page import Viewer
from webmap.gate.commands import begins_like_stop
from webmap.gate.protocol import Role
from webmap.server.open_pages import GateConnection, OpenPages
from webmap.server.outbox import BatchedCallsByLoop, DriveQueue
from webmap.server.page_socket import (
    BROKEN_RULE,
    DRIVE,
    FAILED,
    OpenSockets,
    PageSocket,
    accept,
    close,
    page_id_of,
)
from webmap.server.security import VIEWER

ConnectToGate = Callable[
    [str, Role, Callable[[str], None], Callable[[str], None]], GateConnection
]
"""Opens a connection to the gate for a viewer's name and role. The two callbacks send
to the page and close its socket; they may be called from any thread."""

log = logging.getLogger("webmap.server")

MOST_LAST_STOPS = 60
"""The greatest number of STOPs that are served for a disconnected page: those of one
second."""


class DriveSockets:
    """The ``/_webmap/drive`` sockets of one application."""

    def __init__(
        self,
        pages: OpenPages,
        connect_to_gate: ConnectToGate,
        calls: BatchedCallsByLoop,
        limit: int,
    ) -> None:
        self._pages = pages
        self._connect_to_gate = connect_to_gate
        self._calls = calls
        self._open = OpenSockets(limit)

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
        name = f"drive for {viewer.name}"
        page_socket = PageSocket(
            socket, name, self._calls.of_this_loop(), DRIVE, DriveQueue()
        )
        async with self._open.holding((viewer.id, page_id), page_socket) as has_room:
            if has_room:
                await self._carry(page_socket, page_id, viewer, limited=named)
            else:
                await page_socket.refuse_full()

    async def _carry(
        self, page_socket: PageSocket, page_id: str, viewer: Viewer, *, limited: bool
    ) -> None:
        try:
            connection = self._connect(page_socket, viewer)
            if limited:
                # Until the model, which may be busy, has set the page's speeds.
                connection.set_speeds(0.0, 0.0)
        except Exception:
            log.exception("%s cannot reach the gate", viewer.name)
            await page_socket.refuse(
                FAILED, "no connection to the gate; see the log of WebMap"
            )
            return
        try:
            self._pages.drive_opened(page_id, viewer, connection)

            last_stops = iter(range(MOST_LAST_STOPS))

            def rest(message: str | bytes) -> None:
                # A STOP of a disconnected page is still served (S10).
                if isinstance(message, str):
                    data = message.encode(errors="replace")
                else:
                    data = message
                if begins_like_stop(data) and next(last_stops, None) is not None:
                    connection.receive(message)

            await page_socket.run(
                connection.receive, lambda why: self._pages.refused(viewer, why), rest
            )
        finally:
            # The gate first: the connection's leases end with it, and robots stop.
            connection.close()
            self._pages.drive_closed(page_id, viewer, connection)

    def _connect(self, page_socket: PageSocket, viewer: Viewer) -> GateConnection:
        def close(reason: str) -> None:
            page_socket.end(BROKEN_RULE, reason)

        return self._connect_to_gate(viewer.name, viewer.role, page_socket.offer, close)
