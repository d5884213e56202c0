"""Answers that are not a page: a refusal, a way to sign in."""

from html import escape
from http import HTTPStatus

from starlette.responses import HTMLResponse, PlainTextResponse, Response

from webmap.server.door import GoOn, Refusal

_SIGN_IN = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<meta name="color-scheme" content="light dark">
<title>Sign in - WebMap</title>
<main>
<h1>Sign in to WebMap</h1>
<p>{text}</p>
<p>Open the address that WebMap printed when it started, or enter the token in it:</p>
<form>
<label>Token <input name="token" type="password" autocomplete="off" required></label>
<button>Sign in</button>
</form>
<p>If you have just signed in through a link on another site, <a href="?">go on</a>.</p>
</main>
</html>
"""


def plain(status: int, text: str) -> Response:
    """Return a refusal as a heading and a sentence of plain text."""
    phrase = HTTPStatus(status).phrase
    return PlainTextResponse(f"{status} {phrase}\n\n{text}\n", status)


def refuse(refusal: Refusal, *, wants_html: bool) -> Response:
    """Return what a refused request is answered with."""
    if refusal.status == HTTPStatus.UNAUTHORIZED and wants_html:
        return HTMLResponse(_SIGN_IN.format(text=escape(refusal.text)), refusal.status)
    response = plain(refusal.status, refusal.text)
    if refusal.retry_after:
        response.headers["retry-after"] = str(refusal.retry_after)
    return response


def go_on(to: GoOn) -> Response:
    """Return the redirect to an address without the token."""
    response = Response(status_code=HTTPStatus.SEE_OTHER)
    response.headers["location"] = to.location
    return response
