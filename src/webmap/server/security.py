"""Access control as ASGI middleware, which also adds the headers of every answer.

Before a visitor has signed in, the only page is the one that asks for the token.
"""

import asyncio
import base64
import contextlib
import hashlib
import inspect
import logging
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from html import escape
from http import HTTPStatus
from urllib.parse import parse_qsl, urlencode

from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from webmap.core.operators import Viewer
from webmap.core.shift_log import Person, shift_log
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
from webmap.server.html import FOLDER, base_from, relative

log = logging.getLogger("webmap.server")

CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; "
    "connect-src 'self'; manifest-src 'self'; frame-ancestors 'none'; base-uri 'none'; "
    "form-action 'self'; require-trusted-types-for 'script'"
)


def policy_with(script: str) -> str:
    """Return the policy of a page that has this script in its HTML."""
    return CONTENT_SECURITY_POLICY.replace("'self'", f"'self' {_source(script)}", 1)


def _source(text: str) -> str:
    """Return the source of a policy that allows one text in the HTML."""
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
    return f"'sha256-{digest}'"


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

_NO_FRAME = b"frame-ancestors 'none'"

_STARTS = {"http.response.start", "websocket.http.response.start"}


def with_headers(
    send: Send,
    cookie: str | None = None,
    embed_from: Iterable[str] = (),
    *,
    closes: bool = False,
) -> Send:
    """Return ``send`` with the headers added that an answer lacks.

    Args:
        send: Sends the answer.
        cookie: A whole Set-Cookie header, which is added too.
        embed_from: Origins whose pages may show the answer in a frame.
        closes: Whether the connection ends after the answer.

    """
    ancestors = f"frame-ancestors {' '.join(embed_from)}".encode()

    async def send_with_headers(message: Message) -> None:
        if message["type"] in _STARTS:
            headers = [
                (name, value)
                for name, value in message.get("headers", [])
                if name.lower() != b"server"
            ]
            present = {name.lower() for name, _ in headers}
            headers += [header for header in HEADERS if header[0] not in present]
            if embed_from:
                headers = [(k, v.replace(_NO_FRAME, ancestors)) for k, v in headers]
            if b"cache-control" not in present:
                headers.append((b"cache-control", b"no-store"))
            if closes:
                headers.append((b"connection", b"close"))
            if cookie is not None:
                headers.append((b"set-cookie", cookie.encode("latin-1")))
            message = {**message, "headers": headers}
        await send(message)

    return send_with_headers


def plain(status: int, text: str) -> Response:
    """Return a refusal as a heading and a sentence of plain text."""
    phrase = HTTPStatus(status).phrase
    return PlainTextResponse(f"{status} {phrase}\n\n{text}\n", status)


def refuse(
    refusal: AccessRefusal, *, wants_html: bool, form: str | None = None
) -> Response:
    """Return the answer to a refused request.

    Args:
        refusal: Why it is refused.
        wants_html: Whether a person sees the answer.
        form: The form of the sign-in of named users; None for that of the token.

    """
    if wants_html and (refusal.status == HTTPStatus.UNAUTHORIZED or form):
        response: Response = sign_in_page(refusal.text, refusal.status, form)
    else:
        response = plain(refusal.status, refusal.text)
    if refusal.retry_after:
        response.headers["retry-after"] = str(refusal.retry_after)
    return response


def redirect(request: RequestHead, to: Redirect) -> Response:
    """Return the redirect to a URL without the token, relative to that of a request."""
    response = Response(status_code=HTTPStatus.SEE_OTHER)
    response.headers["location"] = relative(request.path, to.location)
    return response


HEALTH = "/healthz"
METRICS = "/metrics"
"""Paths with an answer for those who have not signed in."""

VIEWER = "webmap.viewer"
"""The key of the scope with the viewer who makes a request."""

MARKS = "webmap.marks"
"""The key of the scope with what the page's script must know, as names of elements:
that it is in a frame, and that it must ask again whether its person is signed in."""

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
        self._settings = settings
        self._authenticate = settings.authenticate or settings.proxy_users
        self._named = settings.people is not None
        # One at a time, so that strangers keep no other thread busy.
        self._signing_in = asyncio.Lock()
        self._access = AccessControl(settings)
        self._now = now

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on one request, or answer it."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        scope = self._settings.proxies.seen(scope)
        request = RequestHead.of(scope)
        embed_from = sorted(self._settings.embed_from)
        if self._authenticate is None:
            redact(scope)
        who = await self._who(request, scope, receive)
        if isinstance(who, SignedIn):
            scope[PAGE_KEY] = who.key
            send = with_headers(send, who.cookie, embed_from)
            who = who.viewer
            by, at = who.operator, request.address
            shift_log.note("sign-in", "signed in", person=by, role=who.role, address=at)
        else:
            send = with_headers(send, None, embed_from)
        if isinstance(who, Viewer):
            if request.framed and not self._settings.embed_driving:
                who = replace(who, role="viewer")
            scope[VIEWER] = who
            asks = self._settings.proxy_users is not None
            scope[MARKS] = ("webmap-frame",) * request.framed + ("webmap-ask",) * asks
            connection = connection_of(scope)
            with connection.serving() if connection else contextlib.nullcontext():
                await self._app(scope, receive, send)
        elif isinstance(who, Redirect):
            await redirect(request, who)(scope, receive, send)
        elif self._is_shown_to_all(request):
            await self._app(scope, receive, with_headers(send, closes=True))
        else:
            _log_refusal(who, request, scope)
            if request.tokens() or (self._named and _is_sign_in(request, scope)):
                # Without what was typed: it may be a password in the wrong field.
                source = Person("", mark=request.address)
                text = f"a sign-in from {request.address} was refused"
                shift_log.note("sign-in-failed", text, person=source, status=who.status)
            form = self._form(request, scope) if self._named else None
            answer = refuse(who, wants_html=request.wants_html, form=form)
            if connection_of(scope):
                # One request per connection, so that clients who have not signed in
                # cannot keep the server busy with all of theirs at once.
                answer.headers["connection"] = "close"
            await _deny(answer, scope, receive, send)

    def new_code(self) -> str:
        """Return a one-time code that signs one browser in."""
        return self._access.codes.issue(self._now())

    def _is_shown_to_all(self, request: RequestHead) -> bool:
        """Return whether a request that is not signed in gets an answer all the same.

        Everybody learns whether WebMap works, and programs of this machine its figures.
        """
        if not request.reads or self._access.check_address(request) is not None:
            return False
        path = request.path.removeprefix(request.root)
        return path == HEALTH or (path == METRICS and self._access.is_local(request))

    async def _who(
        self, request: RequestHead, scope: Scope, receive: Receive
    ) -> Viewer | Redirect | SignedIn | AccessRefusal:
        refusal = self._access.check_address(request)
        if refusal is not None:
            return refusal
        if request.reads and request.root and request.path == request.root:
            # The page's own addresses are relative to a path that ends in a slash.
            query = f"?{urlencode(request.query)}" if request.query else ""
            return Redirect(f"{request.root}/{query}")
        if self._named and _is_sign_in(request, scope):
            name, password, path = await _typed(receive)
            sign_in = self._access.sign_in_user
            async with self._signing_in:
                return await asyncio.to_thread(
                    sign_in, request, name, password, path, self._now()
                )
        if self._authenticate is None:
            return self._access.identify(request, self._now())
        viewer = self._authenticate(scope)
        if inspect.isawaitable(viewer):
            viewer = await viewer
        return viewer or AccessRefusal(403, "Your account has no access to WebMap.")

    def _form(self, request: RequestHead, scope: Scope) -> str:
        path = "" if _is_sign_in(request, scope) else request.path
        below = request.path.removeprefix(request.root)
        return _ASK_NAME.format(
            action=escape(f"{base_from(below)}{SIGN_IN}"), path=escape(path)
        )


SIGN_IN = "sign-in"
"""The route of the sign-in of named users, below WebMap's own folder."""

_LONGEST_FORM = 8192


def _is_sign_in(request: RequestHead, scope: Scope) -> bool:
    ours = request.path.removeprefix(request.root) == f"{FOLDER}{SIGN_IN}"
    return ours and scope.get("method") == "POST"


async def _typed(receive: Receive) -> tuple[str, str, str]:
    """Return name, password and path of a form; empty ones if it is too long."""
    data = b""
    while len(data) <= _LONGEST_FORM:
        message = await receive()
        data += message.get("body", b"")
        if not message.get("more_body"):
            break
    if len(data) > _LONGEST_FORM:
        data = b""
    fields = dict(parse_qsl(data.decode("latin-1"), max_num_fields=8))
    return fields.get("name", ""), fields.get("password", ""), fields.get("path", "")


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


_STYLE = """
:root {
  color-scheme: light dark;
  --surface: #ffffff; --page: #dfe4ea; --text: #131920; --muted: #4b5765;
  --line: #7b8795; --accent: #0a58ca; --on-accent: #ffffff;
}
@media (prefers-color-scheme: dark) {
  :root {
    --surface: #161b22; --page: #0b0f14; --text: #e8edf3; --muted: #a7b3c1;
    --line: #758292; --accent: #6cabff; --on-accent: #081525;
  }
}
* { box-sizing: border-box; }
body {
  display: grid; place-items: center; min-height: 100vh; margin: 0; padding: 1rem;
  background: var(--page); color: var(--text);
  font: 1rem/1.45 -apple-system, "Segoe UI", Roboto, "Noto Sans", Arial, sans-serif;
}
main {
  width: min(26rem, 100%); padding: 2rem; border-radius: 0.75rem;
  background: var(--surface);
}
svg { width: 2.75rem; height: 2.75rem; }
rect { fill: var(--accent); }
path { fill: var(--on-accent); }
h1 { margin: 0.75rem 0 0.25rem; font-size: 1.375rem; }
p { margin: 0 0 1rem; color: var(--muted); }
.why { color: var(--text); font-weight: 600; }
label { display: block; margin-bottom: 0.25rem; font-weight: 600; }
input + label { margin-top: 0.75rem; }
input, button {
  width: 100%; min-height: 2.75rem; border-radius: 0.5rem; font: inherit;
}
input {
  padding: 0 0.75rem; border: 1px solid var(--line); background: var(--surface);
  color: inherit;
}
button {
  margin: 0.75rem 0 1rem; border: 0; background: var(--accent);
  color: var(--on-accent); font-weight: 650; cursor: pointer;
}
a { color: var(--accent); }
:focus-visible { outline: 3px solid var(--accent); outline-offset: 2px; }
p:last-child { margin: 0; font-size: 0.875rem; }
"""

_PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>Sign in - WebMap</title>
<style>{style}</style>
<main>
<svg viewBox="0 0 32 32" aria-hidden="true"><rect width="32" height="32" rx="7"/>
<path d="M16 6.5l8.5 18L16 20l-8.5 4.5z"/></svg>
<h1>Sign in to WebMap</h1>
<p class="why" role="status">{text}</p>
{form}
<p>If you have just signed in through another site, <a href="?">continue</a>.</p>
</main>
</html>
"""

_ASK_TOKEN = """<p>Open the address that WebMap printed at its start, or enter its
token:</p>
<form>
<label for="token">Token</label>
<input name="token" id="token" type="password" autocomplete="off" required autofocus>
<button>Sign in</button>
</form>"""  # noqa: S105 - a form

_ASK_NAME = """<form method="post" action="{action}">
<input type="hidden" name="path" value="{path}">
<label for="name">Name</label>
<input name="name" id="name" autocomplete="username" maxlength="100" required autofocus>
<label for="password">Password</label>
<input name="password" id="password" type="password" autocomplete="current-password"
 maxlength="256" required>
<button>Sign in</button>
</form>"""

_POLICY = (
    f"default-src 'none'; style-src {_source(_STYLE)}; frame-ancestors 'none'; "
    "base-uri 'none'; form-action 'self'"
)
"""This page has its style in it, and needs nothing else."""


def sign_in_page(text: str, status: int, form: str | None = None) -> HTMLResponse:
    """Return the page that asks for the token, or for a name and a password.

    Args:
        text: Why the request was refused.
        status: The HTTP status of the refusal.
        form: The form, if it is not that of the token.
    """
    page = _PAGE.format(style=_STYLE, text=escape(text), form=form or _ASK_TOKEN)
    headers = {"content-security-policy": _POLICY}
    if form is not None:
        # Without a referrer a browser sends a form with the origin "null".
        headers["referrer-policy"] = "same-origin"
    return HTMLResponse(page, status, headers)
