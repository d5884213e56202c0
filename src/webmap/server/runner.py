"""The web server: uvicorn, configured for small messages; and the browser of its user.

Every user of a machine can read the command line of every process. So the browser gets
the name of a file that only its owner can read, and the file redirects to the page.
"""

import asyncio
import contextlib
import functools
import logging
import os
import socket
import tempfile
import threading
import webbrowser
from collections.abc import Callable, Coroutine, Iterator
from html import escape
from pathlib import Path
from types import FrameType
from typing import Any

import uvicorn

from webmap.base.errors import ConfigError, WebMapError
from webmap.base.processes import return_large_pieces, why_not_listening
from webmap.base.tls import Renewal
from webmap.server.access import CODE
from webmap.server.app import WebApp
from webmap.server.auth import CODE_LIFE_S
from webmap.server.connections import protocols
from webmap.server.origins import WILDCARD, is_loopback
from webmap.server.own_files import own_files

log = logging.getLogger("webmap.server")

PING_EVERY_S = 2.0
PONG_WITHIN_S = 4.0
_MAX_MESSAGE = 64 * 1024
# How many connections are accepted before those that are open are served again, so that
# many new ones delay no STOP. uvicorn has one number for this and for the queue in the
# kernel, so the latter is set afterwards.
_ACCEPTED_AT_ONCE = 4
_BACKLOG = 1024

# A peer that acknowledges nothing for this long is gone, in milliseconds. Without it a
# stalled viewer's socket stays open for a quarter of an hour.
_USER_TIMEOUT_MS = 10_000

_HANDSHAKE_S = 5.0
_RENEWAL_S = 30.0


def check_exposure(host: str, *, tls: bool = False, insecure_lan: bool = False) -> None:
    """Refuse to be reachable from other machines without TLS unless that was requested.

    Raises:
        ConfigError: If ``host`` is not this machine alone and both are false.

    """
    if not is_loopback(host) and not tls and not insecure_lan:
        raise ConfigError(
            f"host {host!r} can be reached from other machines, and without TLS "
            "anyone on the network can read the token and drive the robots: set "
            "tls=True (--tls), or keep 127.0.0.1 and put a proxy with TLS or an SSH "
            "tunnel in front, or set insecure_lan=True (--insecure-lan) if you trust "
            "this network"
        )


def listen(host: str, port: int) -> socket.socket:
    """Return a listening socket.

    Args:
        host: A name or an address of this machine.
        port: From 0 to 65535; 0 lets the kernel choose.

    Raises:
        ConfigError: If that is not possible; the message has the reason.

    """
    if not 0 <= port <= 65535:
        raise ConfigError(f"a port is a number from 0 to 65535, got {port}")
    try:
        found = socket.getaddrinfo(
            host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )
    except (OSError, UnicodeError) as error:
        raise ConfigError(f"there is no host {host!r} to listen on") from error
    family, _, _, _, address = found[0]
    listener = socket.socket(family, socket.SOCK_STREAM)
    try:
        if os.name == "posix":
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if hasattr(socket, "TCP_USER_TIMEOUT"):
            listener.setsockopt(
                socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _USER_TIMEOUT_MS
            )
        listener.bind(address)
        listener.listen(_BACKLOG)
    except OSError as error:
        listener.close()
        raise ConfigError(why_not_listening(host, port, error)) from error
    return listener


def url_of(listener: socket.socket, host: str, *, tls: bool = False) -> str:
    """Return the URL of a listening socket for a browser on this machine."""
    name = "127.0.0.1" if host in WILDCARD else host
    bracketed = f"[{name}]" if ":" in name else name
    scheme = "https" if tls else "http"
    return f"{scheme}://{bracketed}:{listener.getsockname()[1]}/"


def announce(url: str) -> None:
    """Print the line with the page's URL, without buffering."""
    print(f"WebMap is ready at {url}", flush=True)


def serve(
    app: WebApp,
    *,
    host: str = "127.0.0.1",
    port: int = 8000,
    tls: Renewal | None = None,
    insecure_lan: bool = False,
    listener: socket.socket | None = None,
    on_ready: Callable[[str], object] = announce,
) -> None:
    """Serve the application in this thread until SIGINT or SIGTERM.

    Args:
        app: The web application.
        host: The address to listen on.
        port: The port; 0 lets the kernel choose.
        tls: The certificate; without one the page is served over plain HTTP.
        insecure_lan: Without it only this machine is served over plain HTTP.
        listener: A socket from :func:`listen` that was opened before, so that nothing
            starts if the port is in use; closed here.
        on_ready: Called once with the URL when the page can be opened.

    Raises:
        ConfigError: If it cannot listen there.
        WebMapError: If the application's own start failed; the log has the reason.

    """
    check_exposure(host, tls=tls is not None, insecure_lan=insecure_lan)
    return_large_pieces()
    listener = listener or listen(host, port)
    url = url_of(listener, host, tls=tls is not None)
    proxies = app.settings.proxies
    if proxies.origin:
        url = f"{proxies.origin}{proxies.base}/"
    if app.settings.has_token:
        url += f"?token={app.settings.token}"
    server = make_server(app, lambda: on_ready(url), tls)
    try:
        server.run(sockets=[listener])
    except SystemExit as error:
        raise WebMapError("the web application did not start") from error
    finally:
        listener.close()
    if server.failure is not None:
        raise server.failure


def make_server(
    app: WebApp, on_ready: Callable[[], object], tls: Renewal | None = None
) -> "Server":
    """Return the server of :func:`serve`, for callers that run it themselves."""
    http, ws = protocols()
    config = uvicorn.Config(
        app,
        interface="asgi3",
        http=http,
        ws=ws,
        ws_max_size=_MAX_MESSAGE,
        ws_ping_interval=PING_EVERY_S,
        ws_ping_timeout=PONG_WITHIN_S,
        # Compression costs 27 to 90 times the send, for a tenth of the bytes.
        ws_per_message_deflate=False,
        # Otherwise any client could claim another address.
        proxy_headers=False,
        server_header=False,
        # At INFO, uvicorn logs the URL of each socket with its query.
        access_log=False,
        log_config=None,
        log_level=logging.WARNING,
        backlog=_ACCEPTED_AT_ONCE,
        timeout_graceful_shutdown=1,
        ssl_context_factory=None if tls is None else lambda *_: tls.context,
    )
    return Server(config, on_ready, app.watch_people, tls)


class Server(uvicorn.Server):
    """A server with a callback when it is ready, which a signal ends."""

    def __init__(
        self,
        config: uvicorn.Config,
        on_ready: Callable[[], object],
        watch_people: Callable[[], Coroutine[Any, Any, None]],
        tls: Renewal | None = None,
    ) -> None:
        super().__init__(config)
        self._on_ready = on_ready
        self._watch_people = watch_people
        self._tls = tls
        self.failure: Exception | None = None
        self._reading: asyncio.Task[str] | None = None
        self._tasks: list[asyncio.Task[None]] = []

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start to listen, then call the callback."""
        # The first page does not wait for it.
        self._reading = asyncio.create_task(asyncio.to_thread(own_files.version))
        self._tasks.append(asyncio.create_task(self._watch_people()))
        if self._tls is not None:
            self._tasks.append(asyncio.create_task(_renew(self._tls)))
            _limit_handshakes(asyncio.get_running_loop())
        await super().startup(sockets)
        for listener in sockets or ():
            listener.listen(_BACKLOG)
        try:
            self._on_ready()
        except Exception as error:
            # Not raised here: the parts already started would not be stopped.
            self.failure, self.should_exit = error, True

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """End the server on a signal; the second one does not wait."""
        # uvicorn's own method stores the signal and raises it again at the end, and the
        # process would not exit with 0.
        del sig, frame
        self.force_exit = self.should_exit
        self.should_exit = True


def _limit_handshakes(loop: asyncio.AbstractEventLoop) -> None:
    """Let clients begin TLS within a few seconds; asyncio's own limit is a minute."""
    # uvicorn has no option for it.
    create = functools.partial(loop.create_server, ssl_handshake_timeout=_HANDSHAKE_S)
    loop.create_server = create  # type: ignore[method-assign]


async def _renew(tls: Renewal) -> None:
    """Use a renewed certificate soon after it was written."""
    trouble = ""
    while True:
        await asyncio.sleep(_RENEWAL_S)
        try:
            if await asyncio.to_thread(tls.look):
                log.info("TLS: %s was read again", tls.files.certificate)
            trouble = ""
        except (ConfigError, OSError) as error:
            if str(error) != trouble:
                trouble = str(error)
                log.error("TLS: %s; the old certificate stays in use", trouble)


_HTML = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0;url={url}">
<title>WebMap</title>
<p>This link opens <a href="{url}">WebMap</a>, once.</p>
</html>
"""


@contextlib.contextmanager
def browser_at(url: str, code: str) -> Iterator[None]:
    """Open a page in a browser, and keep the file for it while the block runs.

    The file is removed at the end of the block, or when its code has expired.

    Args:
        url: The URL of the page, without a query.
        code: A one-time code that signs in; empty if people sign in by themselves.

    """
    address = f"{url}?{CODE}={code}" if code else url
    file = _write(_HTML.format(url=escape(address)))
    if file is None:
        logging.getLogger("webmap").warning(
            "no browser is opened, as no file can be written in the home folder or in "
            "%s: open the printed address yourself",
            tempfile.gettempdir(),
        )
        yield
        return
    timer = threading.Timer(CODE_LIFE_S, file.unlink, [True])
    timer.daemon = True
    timer.start()
    # Some browsers return only when they are closed.
    browser = threading.Thread(
        target=webbrowser.open, args=(file.as_uri(),), daemon=True
    )
    browser.start()
    try:
        yield
    finally:
        timer.cancel()
        file.unlink(missing_ok=True)


def _write(html: str) -> Path | None:
    # Browsers installed as snaps cannot read hidden folders or the folder for temporary
    # files.
    for folder in (Path.home(), Path(tempfile.gettempdir())):
        with contextlib.suppress(OSError):
            number, name = tempfile.mkstemp(".html", "webmap-sign-in-", folder)
            with os.fdopen(number, "w", encoding="utf-8") as file:
                file.write(html)
            return Path(name)
    return None
