"""A minimal display with pages, files and ``/scene``, in a thread."""

import asyncio
import contextlib
import socket
import threading
import time
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.responses import HTMLResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from equipment.waiting import wait_for
from webmap.scene import svg
from webmap.scene.document import Document
from webmap.scene.node import Fragment
from webmap.scene.wire.messages import PageHello, read_message
from webmap.scene.wire.session import SceneSession
from webmap.server.security import CONTENT_SECURITY_POLICY

HERE = Path(__file__).parent
PACKAGE = HERE.parents[1] / "src" / "webmap"
HTML = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>test</title>
<link rel="icon" href="_webmap/icon.svg">
<link rel="stylesheet" href="_webmap/web/webmap.css">
<link rel="stylesheet" href="test.css">
<script type="module" src="_webmap/web/page.js"></script></head>
<body><div id="map"></div><p id="log">own text</p><p id="label" class="own">old</p>
</body></html>"""
CSS = """
body { margin: 0 } #map { width: 700px; height: 500px; margin: 5px 0 0 10px }
.framed { border: 3px solid; padding: 2px } .thick { --dot-size: 0.2 }
"""
MODULE = """
export default function attach(map, options, send) {
  const circle = document.createElementNS("http://www.w3.org/2000/svg", "circle");
  circle.setAttribute("class", "half");
  map.overlay.append(circle);
  send({ options, selected: map.selected, width: map.width });
  const off = map.onSelect((selected) => send({ selected }));
  return {
    receive(message) {
      if (message.fail) throw new Error("as asked");
      send({ echo: message });
    },
    destroy() {
      off();
      circle.remove();
      send({ destroyed: true });
    },
  };
}
"""


class Shown:
    """The scene of one page, and the events that the page sent."""

    def __init__(self) -> None:
        self.session = SceneSession()
        self.document = Document()
        self.page = self.session.mount(Fragment(self.document), under=0)
        self.hellos: list[PageHello] = []
        self.events: list[object] = []
        self.socket: WebSocket | None = None
        self.frames = 0

    def add_map(self, width: float = 0, height: float = 0, container: str = "map"):
        """Show a map; return its ``<svg>``, its world and its mount."""
        world = svg.g(class_="world")
        root = svg.svg(world, class_="webmap").set_map(world, width, height)
        under = self.document.bind(container).id
        mount = self.session.mount(Fragment(root), under=under, within=self.page)
        return root, world, mount

    def add_robot(self, world, mount, name="r1", order=100.0):
        """Show a robot on a map; return its group and its mount."""
        robot = svg.g(svg.circle(r=5), class_="robot", data_robot=name)
        inner = self.session.mount(
            Fragment(robot), under=world.id, within=mount, order=order
        )
        return robot, inner


class SceneHost:
    """Serves pages; the scene is changed by :meth:`call`, in the server's thread."""

    def __init__(self) -> None:
        self.shown: dict[str, Shown] = {}
        self.build = lambda shown: None
        self.silent = False
        self.refuse: tuple[int, str] | None = None
        self._sock = socket.socket()
        self._sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._sock.bind(("127.0.0.1", 0))
        port = self._sock.getsockname()[1]
        self.url = f"http://127.0.0.1:{port}/"
        config = uvicorn.Config(
            self._app(),
            log_level="warning",
            ws="websockets-sansio",
            ws_per_message_deflate=False,
            lifespan="off",
        )
        self._server = uvicorn.Server(config)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> "SceneHost":
        self._thread.start()
        wait_for(lambda: self._server.started)
        return self

    def __exit__(self, *_: object) -> None:
        self._server.should_exit = True
        self._server.force_exit = True
        self._thread.join(10)
        self._sock.close()

    def _run(self) -> None:
        async def serve() -> None:
            self._loop = asyncio.get_running_loop()
            await self._server.serve([self._sock])

        asyncio.run(serve())

    def _app(self) -> Starlette:
        routes = [
            Route("/", self._page),
            Route("/test.css", lambda r: self._answer(CSS, "text/css")),
            Route(
                "/_webmap/test.js", lambda r: self._answer(MODULE, "text/javascript")
            ),
            Route(
                "/_webmap/broken.js",
                lambda r: self._answer("nonsense(", "text/javascript"),
            ),
            Route(
                "/_webmap/half.css",
                lambda r: self._answer(".half{fill:red}", "text/css"),
            ),
            Route(
                "/_webmap/icon.svg", lambda r: self._answer("<svg/>", "image/svg+xml")
            ),
            Route("/_webmap/images/x.png", lambda r: self._answer("", "image/png")),
            WebSocketRoute("/_webmap/scene", self._scene),
            WebSocketRoute("/_webmap/drive", self._drive),
            Mount("/_webmap", StaticFiles(directory=PACKAGE)),
        ]
        return Starlette(routes=[Mount("/under/prefix", routes=routes), *routes])

    def _answer(self, text: str, media_type: str) -> Response:
        policy = {"content-security-policy": CONTENT_SECURITY_POLICY}
        return Response(text, media_type=media_type, headers=policy)

    def _page(self, request: object) -> Response:
        policy = {"content-security-policy": CONTENT_SECURITY_POLICY}
        return HTMLResponse(HTML, headers=policy)

    async def _drive(self, web_socket: WebSocket) -> None:
        await web_socket.accept("webmap")
        with contextlib.suppress(WebSocketDisconnect):
            while True:
                await web_socket.receive_text()

    async def _scene(self, web_socket: WebSocket) -> None:
        await web_socket.accept("webmap")
        if self.refuse:
            await web_socket.close(*self.refuse)
            return
        page_id = web_socket.query_params["id"]
        ticking: asyncio.Task[None] | None = None
        with contextlib.suppress(WebSocketDisconnect):
            hello = read_message(web_socket.query_params["hello"])
            assert isinstance(hello, PageHello)
            shown = self.shown.get(page_id)
            if shown is None:
                shown = self.shown[page_id] = Shown()
                self.build(shown)
            shown.hellos.append(hello)
            shown.session.restart()
            shown.socket = web_socket
            ticking = asyncio.create_task(self._tick(shown, web_socket))
            while True:
                text = await web_socket.receive_text()
                shown.events += shown.session.receive(text)
        if ticking:
            ticking.cancel()

    async def _tick(self, shown: Shown, web_socket: WebSocket) -> None:
        while shown.socket is web_socket:
            frame = None if self.silent else shown.session.frame(time.monotonic())
            if frame:
                shown.frames += 1
                await web_socket.send_bytes(frame)
            await asyncio.sleep(0.02)

    # Methods that tests call from their thread.

    def call(self, fn, *args, **kwargs):
        """Call ``fn`` in the server's thread and return the result."""

        async def run():
            return fn(*args, **kwargs)

        return asyncio.run_coroutine_threadsafe(run(), self._loop).result(10)

    def drop(self) -> None:
        """Cut every socket."""

        async def cut() -> None:
            for shown in self.shown.values():
                if shown.socket:
                    await shown.socket.close(1012, "restarting")

        asyncio.run_coroutine_threadsafe(cut(), self._loop).result(10)

    def send(self, data: bytes) -> None:
        """Send bytes that are not a frame to every page."""

        async def send() -> None:
            for shown in self.shown.values():
                await shown.socket.send_bytes(data)

        asyncio.run_coroutine_threadsafe(send(), self._loop).result(10)

    @property
    def one(self) -> Shown:
        """The only page that was opened."""
        (shown,) = self.shown.values()
        return shown

    def events(self, kind: type) -> list:
        return [event for event in self.one.events if isinstance(event, kind)]


def wait(tab, expression):
    """Wait until an expression is true; a page's policy forbids polling in it."""
    return wait_for(lambda: tab.evaluate(expression), expression, page=tab)
