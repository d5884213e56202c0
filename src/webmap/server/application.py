"""``webmap.page``, ``run``, ``start``, ``stop``, ``call`` and ``asgi_app``."""

import functools
import inspect
import logging
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import ExitStack, asynccontextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec

from webmap.base.errors import ConfigError, WebMapError
from webmap.core.page import site
from webmap.core.runtime import FRAME_RATE, runtime

if TYPE_CHECKING:
    from webmap.base.roles import Role
    from webmap.gate.protocol import Identity
    from webmap.server.access import Authenticate
    from webmap.server.app import WebApp
    from webmap.server.open_pages import GateConnection

log = logging.getLogger("webmap")

P = ParamSpec("P")

page = site.page

command_line: dict[str, Any] = {}
"""The options of the command line for :func:`run`; they override a script's own."""

has_run = False
"""Whether :func:`run` was called in this process."""


def start() -> None:
    """Start WebMap: connect the bridges, start the gate, subscribe to the topics.

    :func:`run` calls it, and so does the application of :func:`asgi_app` if the host
    runs its lifespan; a host application that mounts it may call it. A second call does
    nothing.
    """
    runtime.start()


def stop() -> None:
    """Stop WebMap: stop driven robots and close all connections."""
    runtime.stop()


def call(fn: Callable[..., Any], /, *args: Any) -> Any:
    """Call ``fn`` in the model's thread, where robots and maps live, and wait for it.

    Everything that a script uses after :func:`start` belongs to that thread. A
    coroutine function runs there until it has ended. If the waiting is interrupted, as
    by Ctrl+C, the coroutine is cancelled.

    Returns:
        The result of ``fn``. An exception of ``fn`` is raised here.

    Raises:
        RuntimeError: If WebMap has not been started, or this is the model's thread.

    """
    return runtime.run(fn, *args)


def asgi_app(
    *,
    token: str | None = None,
    authenticate: "Authenticate | None" = None,
    hosts: Iterable[str] = (),
    origins: Iterable[str] = (),
    max_pages: int = 100,
    frame_rate: float = FRAME_RATE,
) -> "WebApp":
    """Return the web interface as an ASGI application.

    A server that runs it by itself starts and stops WebMap with it. An application that
    mounts it under a prefix calls :func:`start` and :func:`stop`, because a mounted
    application gets no lifespan events.

    Args:
        token: The secret that signs viewers in by ``?token=``; generated if not given,
            and then available as the application's ``settings.token``.
        authenticate: Takes the ASGI scope of a request and returns its viewer, or None
            to refuse it; in place of the token.
        hosts: Accepted names of the server in addition to those of loopback.
        origins: Origins that may open sockets in addition to the server's own, such as
            ``"https://robots.example.org"`` if a proxy ends TLS.
        max_pages: The greatest number of open pages, at least 1.
        frame_rate: Frames a second for each page at most, from 1 to 60. Fewer let one
            display serve more pages; ticks and commands are as fast as ever.

    Raises:
        ConfigError: If the token is too short, or a host, an origin or a number is not
            valid.

    """
    from webmap.server.access import Settings
    from webmap.server.origins import Hosts, checked_origin

    settings: dict[str, Any] = {
        "authenticate": authenticate,
        "hosts": Hosts.of_binding("127.0.0.1", hosts),
        "origins": frozenset(map(checked_origin, origins)),
        "max_pages": _checked_pages(max_pages),
    }
    runtime.frame_rate = _checked_rate(frame_rate)
    if token is not None:
        settings["token"] = token
    return _make_app(Settings(**settings), with_lifespan=True)


def _after_command_line(fn: Callable[P, None]) -> Callable[P, None]:
    """Call a function with the options of the command line in place of its own."""

    @functools.wraps(fn)
    def call(*args: P.args, **options: P.kwargs) -> None:
        global has_run
        has_run = True
        given = inspect.signature(fn).bind(*args, **options).arguments
        fn(**{**given, **command_line})  # type: ignore[call-arg]

    return call


@_after_command_line
def run(
    host: str = "127.0.0.1",
    port: int = 8080,
    *,
    open_browser: bool = False,
    token: str | None = None,
    tls: bool = False,
    tls_cert: str | Path = "",
    tls_key: str | Path = "",
    insecure_lan: bool = False,
    public_url: str = "",
    trusted_proxies: Iterable[str] = (),
    proxy_user_header: str = "",
    proxy_groups_header: str = "",
    proxy_roles: Iterable[str] = (),
    sign_out_url: str = "",
    embed_from: Iterable[str] = (),
    embed_driving: bool = False,
    max_pages: int = 100,
    frame_rate: float = FRAME_RATE,
) -> None:
    """Start WebMap and serve its pages until Ctrl+C.

    Prints one line with the URL when the page can be opened.

    Args:
        host: The address to listen on.
        port: The port; 0 lets the system choose.
        open_browser: Whether to open the page in a browser.
        token: The secret in the printed URL; generated for each start if not given. The
            opened browser gets a one-time code instead. Named users (``webmap user
            add``) sign in with their passwords, and there is no token.
        tls: Whether to serve over TLS with a certificate that WebMap makes, signed by
            an authority that it keeps for this user; needs the extra ``tls``.
        tls_cert: In place of ``tls``, a file with the certificate of this server in
            PEM, and with those between it and its authority. A renewed file is used
            within a minute.
        tls_key: The file with its private key in PEM, without a password.
        insecure_lan: Whether other machines may be served without TLS, so that
            everybody on the network in between can read the token.
        public_url: The address at which browsers see WebMap behind a proxy, such as
            ``https://example.com/robots``.
        trusted_proxies: Addresses whose headers count: what they forward, and below.
        proxy_user_header: The header in which a proxy names who has signed in there, in
            place of the token; from trusted proxies alone.
        proxy_groups_header: The header with the groups of the person, with commas.
        proxy_roles: What each group may do, such as ``"drivers=operator:bay2/*"`` or
            ``"*=viewer"``; the first one that a person has counts.
        sign_out_url: Where a person signs out at the proxy.
        embed_from: Origins whose pages may show WebMap in a frame; needs TLS.
        embed_driving: Whether robots may be driven there, not only seen and stopped.
        max_pages: The greatest number of open pages, at least 1.
        frame_rate: Frames a second for each page at most, from 1 to 60. Fewer let one
            display serve more pages; ticks and commands are as fast as ever.

    Raises:
        ConfigError: If it cannot listen there, a number is not valid, or the
            certificate cannot be used.

    """
    from webmap.base.tls import Renewal, tls_files
    from webmap.gate.locks import state_folder
    from webmap.server.access import Settings
    from webmap.server.origins import Hosts, checked_origin, is_loopback
    from webmap.server.people import People, UserFile
    from webmap.server.proxy import Grant, Proxies, ProxyUsers
    from webmap.server.runner import (
        announce,
        browser_at,
        check_exposure,
        listen,
        serve,
    )

    # Check everything that can be refused before anything starts.
    runtime.frame_rate = _checked_rate(frame_rate)
    find = tls_files(host, state_folder() / "tls", tls, tls_cert, tls_key)
    certificate = find and Renewal(find)
    check_exposure(host, tls=certificate is not None, insecure_lan=insecure_lan)
    proxies = Proxies.of(public_url, trusted_proxies)
    settings: dict[str, Any] = {
        "hosts": Hosts.of_binding(host, proxies.names),
        "origins": frozenset(filter(None, [proxies.origin])),
        "proxies": proxies,
        "max_pages": _checked_pages(max_pages),
        "embed_from": frozenset(map(checked_origin, embed_from)),
        "embed_driving": embed_driving,
    }
    encrypted = certificate is not None or proxies.origin.startswith("https:")
    for name in proxies.names:
        check_exposure(name, tls=encrypted, insecure_lan=insecure_lan)
    if settings["embed_from"] and not encrypted and not is_loopback(host):
        raise ConfigError("browsers show WebMap in a frame of another page with TLS")
    if proxy_user_header:
        if not proxies.trusted:
            raise ConfigError(
                f"everybody could send {proxy_user_header}: name the address of the "
                "proxy, as --trusted-proxy 127.0.0.1"
            )
        settings["proxy_users"] = ProxyUsers(
            proxy_user_header,
            tuple(map(Grant.read, proxy_roles)),
            proxy_groups_header,
            sign_out_url,
        )
    elif UserFile(state_folder()).read():
        people = settings["people"] = People(state_folder())
        token = people.secret
    if token is not None:
        settings["token"] = token
    app = _make_app(Settings(**settings), with_lifespan=False)
    app.health.certificate = certificate
    listener = listen(host, port)
    browser = ExitStack()

    def ready(url: str) -> None:
        announce(url)
        if certificate is not None and certificate.files.authority is not None:
            log.info(
                "browsers trust this page after you import %s into them; its SHA-256 "
                "fingerprint is %s",
                certificate.files.authority,
                certificate.files.fingerprint,
            )
        if open_browser:
            code = app.new_code() if app.settings.has_token else ""
            browser.enter_context(browser_at(url.partition("?")[0], code))

    try:
        runtime.start()
        serve(
            app,
            host=host,
            port=port,
            tls=certificate,
            insecure_lan=insecure_lan,
            listener=listener,
            on_ready=ready,
        )
    finally:
        browser.close()
        runtime.stop()
        listener.close()


def _checked_pages(number: int) -> int:
    if number < 1:
        raise ConfigError(f"max_pages must be at least 1, got {number}")
    return number


def _checked_rate(rate: float) -> float:
    if not 1.0 <= rate <= FRAME_RATE:
        raise ConfigError(f"frame_rate must be from 1 to {FRAME_RATE:g}, got {rate:g}")
    return rate


def _make_app(settings: Any, *, with_lifespan: bool) -> "WebApp":
    from webmap.server.app import WebApp
    from webmap.server.files import Published
    from webmap.server.open_pages import OpenPages

    published = Published()
    pages = OpenPages(runtime, site.pages, published, max_pages=settings.max_pages)
    runtime.on_stop(pages.close)
    runtime.serve_pages()
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
    identity: "Identity",
    may_drive: Callable[[str], bool] | None,
) -> "GateConnection":
    if runtime.gate is None:
        raise WebMapError("WebMap has not been started: call webmap.start()")
    return runtime.gate.connect(
        name, role, send, close, identity=identity, may_drive=may_drive
    )
