"""The shell of ``/_webmap/drive``: commands to the gate, its word back.

A socket of its own, so that nothing large is ever in a command's way. What the page
sends goes to the gate unread; the gate alone decides.
"""

import logging
import secrets

from starlette.websockets import WebSocket

from webmap.gate.malformed_stop import begins_like_stop
from webmap.server.bounds import DRIVE
from webmap.server.hop import Hops
from webmap.server.line import BROKEN_RULE, FAILED, Line, accept, close
from webmap.server.paths import page_id_of
from webmap.server.ports import DriveConnection, Gate, Model
from webmap.server.queues import DriveQueue
from webmap.server.seats import Seats
from webmap.server.security import VIEWER
from webmap.server.viewer import Viewer

log = logging.getLogger("webmap.server")

MOST_LAST_STOPS = 60
"""So many STOPs are served of a page that is disconnected: a second's worth."""


class DriveSockets:
    """The ``/_webmap/drive`` sockets of one application."""

    def __init__(self, model: Model, gate: Gate, hops: Hops, limit: int) -> None:
        self._model = model
        self._gate = gate
        self._hops = hops
        self._seats: Seats[Line] = Seats(limit)

    async def serve(self, socket: WebSocket) -> None:
        """Serve one socket until it ends."""
        viewer: Viewer = socket.scope[VIEWER]
        # Without an id it drives all the same, as a page of its own.
        named = "id" in socket.query_params
        page_id = page_id_of(socket.query_params) if named else secrets.token_hex(8)
        await accept(socket)
        if page_id is None:
            await close(socket, BROKEN_RULE, "id must be 1 to 64 letters, digits, -, _")
            return
        name = f"drive for {viewer.name}"
        line = Line(socket, name, self._hops.here(), DRIVE, DriveQueue())
        async with self._seats.taken((viewer.id, page_id), line) as seated:
            if seated:
                await self._carry(line, page_id, viewer, limited=named)
            else:
                await line.refuse_full()

    async def _carry(
        self, line: Line, page_id: str, viewer: Viewer, *, limited: bool
    ) -> None:
        try:
            connection = self._connect(line, viewer)
            if limited:
                # Until the model, which may be busy, has said what the page allows.
                connection.set_speeds(0.0, 0.0)
        except Exception:
            log.exception("%s cannot reach the gate", viewer.name)
            await line.refuse(FAILED, "the gate cannot be reached; the log says why")
            return
        try:
            self._model.drive_opened(page_id, viewer, connection)

            last_stops = iter(range(MOST_LAST_STOPS))

            def rest(message: str | bytes) -> None:
                # A page that is disconnected has its STOP served first (S10).
                if isinstance(message, str):
                    data = message.encode(errors="replace")
                else:
                    data = message
                if begins_like_stop(data) and next(last_stops, None) is not None:
                    connection.receive(message)

            await line.run(
                connection.receive, lambda why: self._model.refused(viewer, why), rest
            )
        finally:
            # The gate first: with the connection its leases end and robots stop.
            connection.close()
            self._model.drive_closed(page_id, viewer, connection)

    def _connect(self, line: Line, viewer: Viewer) -> DriveConnection:
        def close(reason: str) -> None:
            line.end(BROKEN_RULE, reason)

        return self._gate.connect(viewer.name, viewer.role, line.offer, close)
