"""How pages and files are answered."""

import asyncio
import logging
from collections.abc import Callable
from pathlib import Path

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.types import Receive, Scope, Send

from webmap.server.files import File, NoSuchFile, read_below
from webmap.server.headers import SANDBOX
from webmap.server.html import base_of, make_page, prepare_page
from webmap.server.paths import find_page, name_in_folder, other_spelling
from webmap.server.plain import plain
from webmap.server.ports import PageEntry, Site
from webmap.server.security import PAGE_KEY

log = logging.getLogger("webmap.server")


async def answer_file(
    request: Request, read: Callable[[], File], *, unchanging: bool = False
) -> Response:
    """Answer with a file, or with nothing but "unchanged" if the browser has it.

    Args:
        request: What is answered.
        read: Called in another thread; may raise :class:`NoSuchFile`.
        unchanging: Whether this URL always means the same content.

    Raises:
        HTTPException: With status 404, if there is no such file.

    """
    try:
        file = await asyncio.to_thread(read)
    except NoSuchFile:
        raise HTTPException(404) from None
    tag = f'"{file.tag}"'
    headers = {
        "etag": tag,
        "cache-control": "private, max-age=31536000, immutable"
        if unchanging
        else "no-cache",
    }
    if file.fleeting:
        headers["cache-control"] = "no-store"
    if file.media_type.startswith("image/"):
        headers["content-security-policy"] = SANDBOX
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return Response(file.data, media_type=file.media_type, headers=headers)


class PageAnswers:
    """Answers for every path that is not WebMap's own: pages, and files beside them."""

    def __init__(self, site: Site) -> None:
        self._site = site
        self._warned: dict[Path, list[str]] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        request = Request(scope, receive)
        if request.method not in {"GET", "HEAD"}:
            raise HTTPException(405, headers={"allow": "GET, HEAD"})
        answer = await self._answer(request, request.path_params["path"])
        await answer(scope, receive, send)

    async def _answer(self, request: Request, path: str) -> Response:
        entry = find_page(self._site, path)
        if entry is not None:
            return await self._page(request, entry)
        entry = find_page(self._site, other_spelling(path))
        if entry is not None:
            root = base_of(request.scope.get("root_path", "")).removesuffix("/_webmap/")
            return RedirectResponse(root + entry.path, 308)
        return await answer_file(request, lambda: self._beside_page("/" + path))

    async def _page(self, request: Request, entry: PageEntry) -> Response:
        base = base_of(request.scope.get("root_path", ""))
        key = request.scope.get(PAGE_KEY)
        headers = {"cache-control": "no-store" if key else "no-cache"}
        if entry.html is None:
            return HTMLResponse(make_page(entry.title, base, key), headers=headers)
        try:
            text = await asyncio.to_thread(entry.html.read_text, "utf-8-sig")
        except (OSError, UnicodeDecodeError) as error:
            log.error("page %s: cannot read %s: %s", entry.path, entry.html, error)
            return plain(500, "The HTML file of this page cannot be read as UTF-8.")
        page = prepare_page(text, base, key)
        self._warn(entry.html, page.blocked)
        return HTMLResponse(page.text, headers=headers)

    def _beside_page(self, path: str) -> File:
        # Longest first: the nearest page knows its own files best.
        for entry in sorted(self._site.pages.values(), key=_depth, reverse=True):
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


def _depth(entry: PageEntry) -> int:
    return entry.path.count("/")
