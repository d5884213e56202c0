"""Fakes of the packages below the server, and a way to run a real server."""

import contextlib
import re
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import httpx

from webmap.base.tls import Renewal
from webmap.core.operators import Viewer
from webmap.gate.protocol import Identity
from webmap.server.app import WebApp
from webmap.server.page_socket import PageSocket
from webmap.server.runner import listen, make_server

TOKEN = "t0ken-" + "A" * 43


@dataclass
class FakePage:
    path: str
    html: Path | None = None
    folder: Path | None = None
    title: str = "WebMap"


class FakeSite:
    def __init__(self, *pages: FakePage) -> None:
        self.pages = {page.path: page for page in pages}


@dataclass
class FakeScene:
    path: str
    page_id: str
    viewer: Viewer
    socket: PageSocket
    received: list[str] = field(default_factory=list)
    times_closed: int = 0

    def receive(self, text: str) -> None:
        self.received.append(text)

    def closed(self) -> None:
        self.times_closed += 1


class FakeModel:
    def __init__(self) -> None:
        self.scenes: list[FakeScene] = []
        self.drives: list[tuple[str, str, FakeDrive]] = []
        self.refusals: list[tuple[str, str]] = []

    def open_scene(
        self, entry_path: str, page_id: str, viewer: Viewer, socket: PageSocket
    ) -> FakeScene:
        scene = FakeScene(entry_path, page_id, viewer, socket)
        self.scenes.append(scene)
        return scene

    def drive_opened(self, page_id, viewer, connection) -> None:
        self.drives.append(("opened", page_id, connection))

    def drive_closed(self, page_id, viewer, connection) -> None:
        self.drives.append(("closed", page_id, connection))

    def refused(self, viewer, why) -> None:
        self.refusals.append((viewer.name, why))


@dataclass
class FakeDrive:
    name: str
    role: str
    send: Callable[[str], None]
    end: Callable[[str], None]
    identity: Identity | None = None
    may_drive: Callable[[str], bool] | None = None
    received: list[str] = field(default_factory=list)
    speeds: tuple[float, float] | None = None
    times_closed: int = 0

    def receive(self, text: str) -> None:
        self.received.append(text)

    def set_speeds(self, v: float, w: float) -> None:
        self.speeds = (v, w)

    def rename(self, name: str) -> None:
        self.name = name

    def close(self) -> None:
        self.times_closed += 1


class FakeGate:
    def __init__(self) -> None:
        self.connections: list[FakeDrive] = []

    def __call__(self, *args) -> FakeDrive:
        return self.connect(*args)

    def connect(self, name, role, send, close, identity, may_drive) -> FakeDrive:
        connection = FakeDrive(name, role, send, close, identity, may_drive)
        self.connections.append(connection)
        return connection


@dataclass
class Browser:
    """The cookie and the keys of a browser that has signed in."""

    cookie: str
    """The Cookie header of the browser."""

    key: str
    """The key with which its pages open their sockets."""

    @property
    def protocols(self) -> list[str]:
        """The subprotocols that its pages offer."""
        return ["webmap", self.key]


def sign_in(url: str) -> Browser:
    """Sign in a new browser with an address that has a token or a code."""
    with httpx.Client(follow_redirects=True) as client:
        page = client.get(url)
        assert page.status_code == 200
        cookie = "; ".join(f"{name}={value}" for name, value in client.cookies.items())
    return Browser(cookie, key_in(page.text))


def key_in(html: str) -> str:
    """Return the key in a page."""
    return re.search(r'<meta name="webmap-key" content="([^"]+)">', html)[1]


class Running:
    """A server that runs in a thread of its own."""

    def __init__(
        self, app: WebApp, port: int, connections: set[object], scheme: str = "http"
    ) -> None:
        self.connections = connections
        """The open connections of the server, HTTP and WebSocket."""
        self.origin = f"{scheme}://127.0.0.1:{port}"
        self.port = port
        self._app = app

    def sign_in(self) -> Browser:
        """Sign in a new viewer and return the browser."""
        return sign_in(f"{self.origin}/?token={self._app.settings.token}")

    def socket_url(self, name: str) -> str:
        return f"ws://127.0.0.1:{self.port}/_webmap/{name}"


@contextlib.contextmanager
def running(app: WebApp, tls: Renewal | None = None) -> Iterator[Running]:
    """Serve an application on a port that the kernel chooses."""
    ready = threading.Event()
    listener = listen("127.0.0.1", 0)
    port = listener.getsockname()[1]
    server = make_server(app, ready.set, tls)
    scheme = "https" if tls else "http"
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    try:
        assert ready.wait(20)
        yield Running(app, port, server.server_state.connections, scheme)
    finally:
        server.should_exit = True
        thread.join(20)
        assert not thread.is_alive()
