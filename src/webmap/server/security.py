"""Access control as ASGI middleware, which also adds the headers of every answer."""

import contextlib
import inspect
import logging
import time
from collections.abc import Callable
from http import HTTPStatus

from starlette.responses import PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from webmap.core.base_page import Viewer
from webmap.server.access import (
    AccessControl,
    AccessRefusal,
    Redirect,
    RequestHead,
    Settings,
    SignedIn,
    redact,
)
from webmap.server.connections import connection_of
from webmap.server.sign_in import sign_in_page

log = logging.getLogger("webmap.server")

CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; "
    "connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; "
    "form-action 'self'; require-trusted-types-for 'script'"
)

HEADERS = (
    (b"content-security-policy", CONTENT_SECURITY_POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    # Another port of this machine is the same site, so SameSite does not exclude it.
    (b"cross-origin-resource-policy", b"same-origin"),
)

# An image opened by itself is a document; it must never run scripts.
SANDBOX = CONTENT_SECURITY_POLICY + "; sandbox"

_STARTS = {"http.response.start", "websocket.http.response.start"}


def with_headers(send: Send, cookie: str | None = None) -> Send:
    """Return ``send`` with the headers added that an answer lacks.

    Args:
        send: Sends the answer.
        cookie: A whole Set-Cookie header, which is added too.

    """

    async def send_with_headers(message: Message) -> None:
        if message["type"] in _STARTS:
            headers = [
                (name, value)
                for name, value in message.get("headers", [])
                if name.lower() != b"server"
            ]
            present = {name.lower() for name, _ in headers}
            headers += [header for header in HEADERS if header[0] not in present]
            if b"cache-control" not in present:
                headers.append((b"cache-control", b"no-store"))
            if cookie is not None:
                headers.append((b"set-cookie", cookie.encode("latin-1")))
            message = {**message, "headers": headers}
        await send(message)

    return send_with_headers


def plain(status: int, text: str) -> Response:
    """Return a refusal as a heading and a sentence of plain text."""
    phrase = HTTPStatus(status).phrase
    return PlainTextResponse(f"{status} {phrase}\n\n{text}\n", status)


def refuse(refusal: AccessRefusal, *, wants_html: bool) -> Response:
    """Return the answer to a refused request."""
    if refusal.status == HTTPStatus.UNAUTHORIZED and wants_html:
        return sign_in_page(refusal.text, refusal.status)
    response = plain(refusal.status, refusal.text)
    if refusal.retry_after:
        response.headers["retry-after"] = str(refusal.retry_after)
    return response


def redirect(to: Redirect) -> Response:
    """Return the redirect to a URL without the token."""
    response = Response(status_code=HTTPStatus.SEE_OTHER)
    response.headers["location"] = to.location
    return response


VIEWER = "webmap.viewer"
"""The key of the scope with the viewer who makes a request."""

PAGE_KEY = "webmap.page_key"
"""The key of the scope with the page's key, if the request signs in."""


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
        self._access = AccessControl(settings)
        self._now = now

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on one request, or answer it."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        request = RequestHead.of(scope)
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
        elif isinstance(who, Redirect):
            await redirect(who)(scope, receive, send)
        else:
            _log_refusal(who, request, scope)
            answer = refuse(who, wants_html=request.wants_html)
            if connection_of(scope):
                # One request per connection, so that clients who have not signed in
                # cannot keep the server busy with all of theirs at once.
                answer.headers["connection"] = "close"
            await _deny(answer, scope, receive, send)

    def new_code(self) -> str:
        """Return a one-time code that signs one browser in."""
        return self._access.codes.issue(self._now())

    async def _who(
        self, request: RequestHead, scope: Scope
    ) -> Viewer | Redirect | SignedIn | AccessRefusal:
        refusal = self._access.check_address(request)
        if refusal is not None:
            return refusal
        if self._authenticate is None:
            return self._access.identify(request, self._now())
        viewer = self._authenticate(scope)
        if inspect.isawaitable(viewer):
            viewer = await viewer
        return viewer or AccessRefusal(403, "Your account has no access to WebMap.")


async def _deny(answer: Response, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "http" or "websocket.http.response" in scope.get(
        "extensions", {}
    ):
        await answer(scope, receive, send)
    else:
        # Servers without the extension turn this into 403, also before the upgrade.
        await send({"type": "websocket.close", "code": 1008, "reason": ""})


def _log_refusal(refusal: AccessRefusal, request: RequestHead, scope: Scope) -> None:
    if refusal.status == 401 and not request.tokens():
        return
    # With repr, so that a request cannot write its own lines into the log.
    log.warning(
        "refused %s %r from %s: status %d (host %r, origin %r)",
        scope["type"],
        request.path[:100],
        request.address or "an unknown address",
        refusal.status,
        [host[:100] for host in request.hosts],
        [origin[:100] for origin in request.origins],
    )
