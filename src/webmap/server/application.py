"""``webmap.page``, ``run``, ``start``, ``stop`` and ``asgi_app``."""

import logging
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import ExitStack, asynccontextmanager
from typing import TYPE_CHECKING, Any

from webmap.base.errors import WebMapError
from webmap.core.page import site
from webmap.core.runtime import runtime

if TYPE_CHECKING:
    from webmap.gate.display.client import DriveConnection
    from webmap.gate.messages import Role
    from webmap.server.access import Authenticate
    from webmap.server.app import WebApp

log = logging.getLogger("webmap")

page = site.page

command_line: dict[str, Any] = {}
"""What the command line says of :func:`run`; it comes before a script's own word."""

has_run = False
"""Whether :func:`run` was called in this process."""


def start() -> None:
    """Begin: connect the bridges, start the gate, follow the topics.

    :func:`run` does it by itself, as does the application of :func:`asgi_app` where
    the host runs its lifespan; a host application that mounts it may call this. The
    second call does nothing.
    """
    runtime.start()


def stop() -> None:
    """End what :func:`start` began: driven robots are stopped, links are closed."""
    runtime.stop()


def call(fn: Callable[..., object], /, *args: Any) -> None:
    """Call ``fn`` in the model's thread, where robots and maps live, soon.

    Everything that a script touches after :func:`start` belongs to that thread.

    Raises:
        RuntimeError: If WebMap has not been started.

    """
    runtime.call(fn, *args)


def asgi_app(
    *,
    token: str | None = None,
    authenticate: "Authenticate | None" = None,
    hosts: Iterable[str] = (),
    origins: Iterable[str] = (),
) -> "WebApp":
    """Return the web interface as an ASGI application.

    A server that runs it by itself starts and stops WebMap with it. An application
    that mounts it under a prefix calls :func:`start` and :func:`stop`, because what
    is mounted is not told when the server starts.

    Args:
        token: The secret that signs viewers in by ``?token=``; made if not given, and
            then found in the application's ``settings.token``.
        authenticate: Takes the ASGI scope of a request and returns the viewer who
            makes it, or None to refuse it; in place of the token.
        hosts: Names besides loopback's by which the server may be called.
        origins: Origins besides the server's own that may open sockets, as
            ``"https://robots.example.org"`` where a proxy ends TLS.

    Raises:
        ConfigError: If the token is too short, or a host or an origin is none.

    """
    from webmap.server.access import Settings
    from webmap.server.origins import Hosts, checked_origin

    settings: dict[str, Any] = {
        "authenticate": authenticate,
        "hosts": Hosts.of_binding("127.0.0.1", hosts),
        "origins": frozenset(map(checked_origin, origins)),
    }
    if token is not None:
        settings["token"] = token
    return _make_app(Settings(**settings), with_lifespan=True)


def run(
    host: str = "127.0.0.1",
    port: int = 8080,
    *,
    open_browser: bool = False,
    token: str | None = None,
    insecure_lan: bool = False,
) -> None:
    """Start WebMap and serve its pages until Ctrl+C.

    Prints one line with the URL when the page can be opened.

    Args:
        host: The address to listen on.
        port: The port; 0 lets the system choose.
        open_browser: Whether to open the page in a browser.
        token: The secret in the printed URL; made for each start if not given. The
            browser that is opened gets a one-time code instead.
        insecure_lan: Whether other machines may be served without TLS, where
            everybody on the way can read the token.

    Raises:
        ConfigError: If it cannot listen there.

    """
    global has_run
    has_run = True
    options: dict[str, Any] = {"host": host, "port": port}
    options |= {"open_browser": open_browser, "insecure_lan": insecure_lan}
    options |= command_line
    _serve(token=token, **options)


def _serve(
    *, host: str, port: int, open_browser: bool, insecure_lan: bool, token: str | None
) -> None:
    from webmap.server.access import Settings
    from webmap.server.opening import opened
    from webmap.server.origins import Hosts
    from webmap.server.runner import announce, check_exposure, listen, serve

    # All that can be refused is refused before anything starts.
    check_exposure(host, insecure_lan=insecure_lan)
    settings: dict[str, Any] = {"hosts": Hosts.of_binding(host)}
    if token is not None:
        settings["token"] = token
    app = _make_app(Settings(**settings), with_lifespan=False)
    listener = listen(host, port)
    browser = ExitStack()

    def ready(url: str) -> None:
        announce(url)
        if open_browser:
            browser.enter_context(opened(url.partition("?")[0], app.new_code()))

    try:
        runtime.start()
        serve(
            app,
            host=host,
            port=port,
            insecure_lan=insecure_lan,
            listener=listener,
            on_ready=ready,
        )
    finally:
        browser.close()
        runtime.stop()
        listener.close()


def _make_app(settings: Any, *, with_lifespan: bool) -> "WebApp":
    from webmap.server.app import WebApp
    from webmap.server.files import Published
    from webmap.server.open_pages import OpenPages

    published = Published()
    pages = OpenPages(runtime, site.pages, published, max_pages=settings.max_pages)
    runtime.on_stop(pages.close)
    lifespan = _live if with_lifespan else None
    return WebApp(
        site, pages, _connect_to_gate, settings, published=published, lifespan=lifespan
    )


@asynccontextmanager
async def _live(app: object) -> AsyncIterator[None]:
    runtime.start()
    try:
        yield
    finally:
        runtime.stop()


def _connect_to_gate(
    name: str,
    role: "Role",
    send: Callable[[str], None],
    close: Callable[[str], None],
) -> "DriveConnection":
    if runtime.gate is None:
        raise WebMapError("WebMap has not been started: call webmap.start()")
    return runtime.gate.connect(name, role, send, close)
