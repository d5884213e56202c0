"""The web application: routes of requests."""

import asyncio
import gzip
import logging
import time
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import (
    HTMLResponse,
    JSONResponse,
    PlainTextResponse,
    RedirectResponse,
    Response,
)
from starlette.routing import Route, WebSocketRoute
from starlette.types import Receive, Scope, Send

from webmap.base.errors import WebMapError
from webmap.base.roles import Role, covers, who_may
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Site
from webmap.core.pictures import VIDEOS
from webmap.core.shift_choice import Choice, csv_of
from webmap.core.shift_log import shift_log
from webmap.server.access import Settings
from webmap.server.files import (
    FILES,
    IMAGES,
    File,
    GzipCache,
    NoSuchFile,
    Published,
    accepts_gzip,
    is_worth_compressing,
    read_below,
)
from webmap.server.health import Health
from webmap.server.html import base_from, make_page, prepare_page, relative
from webmap.server.open_pages import OpenPages
from webmap.server.outbox import BatchedCallsByLoop
from webmap.server.own_files import own_files
from webmap.server.security import (
    HEALTH,
    MARKS,
    METRICS,
    PAGE_KEY,
    SANDBOX,
    VIEWER,
    Security,
    plain,
    policy_with,
)
from webmap.server.sockets import (
    ConnectToGate,
    DriveSockets,
    SceneSockets,
    VideoSockets,
    find_page,
)

log = logging.getLogger("webmap.server")

_PEOPLE_S = 0.4
"""Seconds after which changes of users and sessions take effect."""

Lifespan = Callable[[Starlette], AbstractAsyncContextManager[None]]


class RouteFor(Route):
    """A route with the least role of those who may use it.

    Who has not signed in reaches only what :class:`Security` lets everybody see.
    """

    def __init__(
        self,
        least: Role,
        path: str,
        endpoint: Callable[..., object],
        methods: list[str] | None = None,
    ) -> None:
        super().__init__(path, endpoint, methods=methods)
        self.least = least

    async def handle(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer those who may, and refuse all others."""
        viewer: Viewer | None = scope.get(VIEWER)
        if viewer is not None and not covers(viewer.role, self.least):
            raise HTTPException(403, who_may(self.least))
        await super().handle(scope, receive, send)


class WebApp:
    """The ASGI application of WebMap; runs by itself, or mounted under a prefix.

    Args:
        site: The pages that can be opened.
        pages: The open pages.
        connect_to_gate: Opens a connection of a page to the gate.
        settings: Who may use it; by default a new token and this machine only.
        published: The files of the program, if it has published some already.
        lifespan: What to do when a server starts and stops the application, as in
            Starlette; a host that mounts the application does this itself.

    Raises:
        ConfigError: If the settings' token is too short.

    """

    def __init__(
        self,
        site: Site,
        pages: OpenPages,
        connect_to_gate: ConnectToGate,
        settings: Settings | None = None,
        *,
        published: Published | None = None,
        lifespan: Lifespan | None = None,
    ) -> None:
        self.settings = settings = settings or Settings()
        shift_log.hide(settings.token)
        self.published = published or Published()
        self._gzip = GzipCache()
        self.health = Health()
        """Whether this process works."""
        calls = BatchedCallsByLoop()
        self._sockets = (
            SceneSockets(site, pages, calls, settings.max_pages),
            DriveSockets(pages, connect_to_gate, calls, settings.max_pages),
            VideoSockets(calls, settings.max_pages),
        )
        scene, drive, video = self._sockets
        self.routes = [
            # Open to every role: each message has a least role of its own.
            WebSocketRoute("/_webmap/scene", scene.serve),
            WebSocketRoute("/_webmap/drive", drive.serve),
            # As pictures: whoever sees the camera on a page has the tag.
            WebSocketRoute(VIDEOS + "{tag}", video.serve),
            RouteFor("viewer", "/_webmap/key", _key_fits, methods=["POST"]),
            RouteFor("viewer", "/_webmap/sign-out", self._sign_out, methods=["POST"]),
            RouteFor("viewer", "/_webmap/shift-log.csv", _shift_log, methods=["POST"]),
            self._files(FILES + "{name:path}", self.published.file),
            self._files(IMAGES + "{tag}", self.published.image),
            self._files("/_webmap/{name:path}", own_files.file),
            RouteFor("viewer", HEALTH, self._healthz),
            RouteFor("admin", METRICS, self._metrics),
            RouteFor("viewer", "/{path:path}", PageAnswers(site, self._gzip)),
        ]
        self._security = Security(
            Starlette(
                routes=self.routes,
                exception_handlers={HTTPException: _answer_error},
                lifespan=lifespan or _nothing,
            ),
            settings,
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request, one socket, or the lifespan of the application."""
        await self._security(scope, receive, send)

    def new_code(self) -> str:
        """Return a one-time code; a URL with ``?webmap_code=`` signs in once."""
        return self._security.new_code()

    async def watch_people(self) -> None:
        """End the sockets of people whose session has ended, soon after that."""
        people, trouble = self.settings.people, ""
        while self.settings.lasts is not None:
            try:
                if people is not None:
                    await asyncio.to_thread(people.refresh)
                trouble = ""
            except Exception as error:  # or sessions would never end again
                if str(error) != trouble:
                    trouble = str(error)
                    log.error("the users stay as they were: %s", trouble)
            self._end_sockets()
            await asyncio.sleep(_PEOPLE_S)

    def _end_sockets(self) -> None:
        lasts = self.settings.lasts
        if lasts is not None:
            for sockets in self._sockets:
                sockets.end_unless(lasts)

    async def _sign_out(self, request: Request) -> Response:
        viewer, at_proxy = request.scope[VIEWER], self.settings.proxy_users
        log.info("%s signed out", viewer.operator.logged)
        shift_log.note("sign-in", "signed out", person=viewer.operator)
        if self.settings.people is not None:
            await asyncio.to_thread(self.settings.people.end, viewer.id)
            self._end_sockets()
        if at_proxy is None:
            return Response(status_code=204)
        return PlainTextResponse(at_proxy.sign_out_url)

    async def _healthz(self, request: Request) -> Response:
        found = await self.health.look()
        status = "not ok" if found.problems else "ok"
        answer: dict[str, object] = {"status": status}
        if VIEWER in request.scope:
            answer |= {"problems": found.problems, "notes": found.notes}
        return JSONResponse(answer, 503 if found.problems else 200)

    async def _metrics(self, request: Request) -> Response:
        try:
            from webmap.server.metrics import rendered
        except WebMapError as error:  # the extra is not installed
            raise HTTPException(501, str(error)) from None
        found, pages = await self.health.look(), self._sockets[0].open
        accept = request.headers.get("accept", "")
        text, media_type = rendered(found, len(pages), pages.viewers, accept)
        return Response(text, headers={"content-type": media_type})

    def _files(self, path: str, read: Callable[[str], File]) -> RouteFor:
        async def answer(request: Request) -> Response:
            (name,) = request.path_params.values()
            return await answer_file(request, self._gzip, lambda: read(name))

        return RouteFor("viewer", path, answer)


async def _key_fits(request: Request) -> Response:
    """Answer a page whose socket was refused: its key is valid."""
    del request
    return Response(status_code=204)


async def _shift_log(request: Request) -> Response:
    """Answer with the chosen entries of the shift log; needs the key of a page."""
    role = request.scope[VIEWER].role
    choice = Choice.of(request.query_params)

    def made() -> str:
        return csv_of(choice.chosen(shift_log.entries(), role, time.time()))

    return Response(await asyncio.to_thread(made), media_type="text/csv")


@asynccontextmanager
async def _nothing(app: Starlette) -> AsyncIterator[None]:
    del app
    yield


async def _answer_error(request: Request, error: Exception) -> Response:
    del request
    assert isinstance(error, HTTPException)
    texts = {
        404: "There is nothing at this address.",
        405: "This address does not accept this HTTP method.",
    }
    answer = plain(error.status_code, texts.get(error.status_code, error.detail))
    answer.headers.update(error.headers or {})
    return answer


async def answer_file(
    request: Request, cache: GzipCache, read: Callable[[], File]
) -> Response:
    """Answer with a file, or with status 304 if the browser has it.

    Args:
        request: The request.
        cache: The files that were compressed before.
        read: Called in another thread; may raise :class:`NoSuchFile`.

    Raises:
        HTTPException: With status 404, if there is no such file.

    """
    return await asyncio.to_thread(_answer_file, request, cache, read)


def _answer_file(
    request: Request, cache: GzipCache, read: Callable[[], File]
) -> Response:
    try:
        file = read()
    except NoSuchFile:
        raise HTTPException(404) from None
    # Weak: the compressed file has the same tag.
    tag = f'W/"{file.tag}"'
    headers = {"etag": tag, "cache-control": "no-cache"}
    if file.unchanging:
        headers["cache-control"] = "private, max-age=31536000, immutable"
    if file.fleeting:
        headers["cache-control"] = "no-store"
    if file.media_type.startswith("image/"):
        headers["content-security-policy"] = SANDBOX
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    data = file.data
    if not file.fleeting and is_worth_compressing(file.media_type, len(data)):
        headers["vary"] = "accept-encoding"
        if accepts_gzip(request.headers.get("accept-encoding", "")):
            headers["content-encoding"] = "gzip"
            data = cache.compressed(data)
    return Response(data, media_type=file.media_type, headers=headers)


class PageAnswers:
    """Serves all paths that are not WebMap's own: pages, and files in their folders."""

    def __init__(self, site: Site, cache: GzipCache) -> None:
        self._site = site
        self._gzip = cache
        self._warned: dict[Path, list[str]] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer GET and HEAD; any other method gets status 405."""
        request = Request(scope, receive)
        if request.method not in {"GET", "HEAD"}:
            raise HTTPException(405, headers={"allow": "GET, HEAD"})
        answer = await self._answer(request, request.path_params["path"])
        await answer(scope, receive, send)

    async def _answer(self, request: Request, path: str) -> Response:
        entry = find_page(self._site, path)
        if entry is not None:
            return await asyncio.to_thread(self._page, request, entry)
        entry = find_page(self._site, other_spelling(path))
        if entry is not None:
            return RedirectResponse(relative("/" + path, entry.path), 308)
        return await answer_file(
            request, self._gzip, lambda: self._folder_file("/" + path)
        )

    def _page(self, request: Request, entry: PageEntry) -> Response:
        files = f"{base_from(entry.path)}v-{own_files.version()}/"
        key, marks = request.scope.get(PAGE_KEY), request.scope.get(MARKS, ())
        opening = own_files.opening()
        if entry.html is None:
            made = make_page(entry.title, files, opening, key, marks)
            return self._html(request, made, opening, key)
        try:
            text = entry.html.read_text("utf-8-sig")
        except (OSError, UnicodeDecodeError) as error:
            log.error("page %s: cannot read %s: %s", entry.path, entry.html, error)
            return plain(500, "The HTML file of this page cannot be read as UTF-8.")
        page = prepare_page(text, files, opening, key, marks)
        self._warn(entry.html, page.blocked)
        return self._html(request, page.text, opening, key)

    def _html(
        self, request: Request, text: str, opening: str, key: str | None
    ) -> Response:
        data = text.encode()
        headers = {
            "cache-control": "no-store" if key else "no-cache",
            "vary": "accept-encoding",
        }
        if opening in text:
            headers["content-security-policy"] = policy_with(opening)
        if accepts_gzip(request.headers.get("accept-encoding", "")):
            headers["content-encoding"] = "gzip"
            # A page with a key is sent once, and the key is not stored.
            data = gzip.compress(data) if key else self._gzip.compressed(data)
        return HTMLResponse(data, headers=headers)

    def _folder_file(self, path: str) -> File:
        # Longest first: the files of the nearest page come first.
        pages = self._site.pages.values()
        for entry in sorted(pages, key=lambda each: -each.path.count("/")):
            name = name_in_folder(entry, path)
            if name is None or entry.folder is None:
                continue
            try:
                return read_below(entry.folder, name)
            except NoSuchFile:
                continue
        raise NoSuchFile

    def _warn(self, html: Path, blocked: list[str]) -> None:
        if self._warned.get(html) != blocked:
            self._warned[html] = blocked
            for sentence in blocked:
                log.warning("%s, %s", html, sentence)


def other_spelling(path: str) -> str:
    """Return a path with the slash at its end removed, or added."""
    return path[:-1] if path.endswith("/") else path + "/"


def name_in_folder(page: PageEntry, path: str) -> str | None:
    """Return a path relative to a page, as in the page's HTML.

    Returns:
        None if the page has no folder of files, or the path is not in it.

    """
    if page.html is None:
        return None
    base = page.path.rpartition("/")[0] + "/"
    return path[len(base) :] if path.startswith(base) else None
