"""The door as ASGI middleware: nothing behind it sees a request it did not let in."""

import contextlib
import inspect
import logging
import time
from collections.abc import Callable

from starlette.responses import Response
from starlette.types import ASGIApp, Receive, Scope, Send

from webmap.server.connections import connection_of
from webmap.server.door import Door, GoOn, Refusal, SignedIn
from webmap.server.headers import with_headers
from webmap.server.plain import go_on, refuse
from webmap.server.request import Request, redact
from webmap.server.settings import Settings
from webmap.server.viewer import Viewer

log = logging.getLogger("webmap.server")

VIEWER = "webmap.viewer"
"""The key of the scope under which the routes find who makes a request."""

PAGE_KEY = "webmap.page_key"
"""The key of the scope under which a page finds the key to hand out, if it signs in."""


class Security:
    """Checks host, origin and sign-in, and gives every answer its headers."""

    def __init__(
        self,
        app: ASGIApp,
        settings: Settings,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._app = app
        self._authenticate = settings.authenticate
        self._door = Door(settings)
        self._now = now

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let one request in, or answer it."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        request = Request.of(scope)
        if self._authenticate is None:
            redact(scope)
        who = await self._who(request, scope)
        if isinstance(who, SignedIn):
            scope[PAGE_KEY] = who.key
            send = with_headers(send, who.cookie)
            who = who.viewer
        else:
            send = with_headers(send)
        if isinstance(who, Viewer):
            scope[VIEWER] = who
            connection = connection_of(scope)
            with connection.serving() if connection else contextlib.nullcontext():
                await self._app(scope, receive, send)
        elif isinstance(who, GoOn):
            await go_on(who)(scope, receive, send)
        else:
            _log_refusal(who, request, scope)
            answer = refuse(who, wants_html=request.wants_html)
            if connection_of(scope):
                # One request for each connection, so that strangers cannot have the
                # server busy with all of theirs at once.
                answer.headers["connection"] = "close"
            await _deny(answer, scope, receive, send)

    def new_code(self) -> str:
        """Return a one-time code that signs one browser in, soon."""
        return self._door.codes.issue(self._now())

    async def _who(
        self, request: Request, scope: Scope
    ) -> Viewer | GoOn | SignedIn | Refusal:
        refusal = self._door.check_address(request)
        if refusal is not None:
            return refusal
        if self._authenticate is None:
            return self._door.identify(request, self._now())
        viewer = self._authenticate(scope)
        if inspect.isawaitable(viewer):
            viewer = await viewer
        return viewer or Refusal(403, "Your account may not use WebMap.")


async def _deny(answer: Response, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "http" or "websocket.http.response" in scope.get(
        "extensions", {}
    ):
        await answer(scope, receive, send)
    else:
        # Servers without the extension turn this into 403, before the upgrade too.
        await send({"type": "websocket.close", "code": 1008, "reason": ""})


def _log_refusal(refusal: Refusal, request: Request, scope: Scope) -> None:
    if refusal.status == 401 and not request.tokens():
        return
    # Repr: what a stranger sends must not write lines of its own into the log.
    log.warning(
        "refused %s %r from %s: status %d (host %r, origin %r)",
        scope["type"],
        request.path[:100],
        request.address or "an unknown address",
        refusal.status,
        [host[:100] for host in request.hosts],
        [origin[:100] for origin in request.origins],
    )
