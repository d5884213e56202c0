"""The web application: which request goes where."""

from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import Receive, Scope, Send

from webmap.server.answers import PageAnswers, answer_file
from webmap.server.drive_socket import DriveSockets
from webmap.server.files import File, NoSuchFile, read_below
from webmap.server.hop import Hops
from webmap.server.plain import plain
from webmap.server.ports import Gate, Model, Site
from webmap.server.published import FILES, IMAGES, Published
from webmap.server.scene_socket import SceneSockets
from webmap.server.security import Security
from webmap.server.settings import Settings

Lifespan = Callable[[Starlette], AbstractAsyncContextManager[None]]

# The browser's files of the whole package, and the few of this room.
STATIC = (Path(__file__).parents[1] / "web", Path(__file__).parent / "assets")


class WebApp:
    """The ASGI application of WebMap; runs by itself, or mounted under a prefix."""

    def __init__(
        self,
        site: Site,
        model: Model,
        gate: Gate,
        settings: Settings,
        published: Published,
        lifespan: Lifespan | None,
    ) -> None:
        self.settings = settings
        self.published = published
        hops = Hops()
        scene = SceneSockets(site, model, hops, settings.max_pages)
        drive = DriveSockets(model, gate, hops, settings.max_pages)
        self.routes = [
            WebSocketRoute("/_webmap/scene", scene.serve),
            WebSocketRoute("/_webmap/drive", drive.serve),
            Route("/_webmap/key", _key_fits, methods=["POST"]),
            Route(FILES + "{name:path}", self._published_file),
            Route(IMAGES + "{tag}", self._published_image),
            Route("/_webmap/{name:path}", self._static),
            Route("/{path:path}", PageAnswers(site)),
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
        """Serve one request, one socket, or the life of the application."""
        await self._security(scope, receive, send)

    def new_code(self) -> str:
        """Return a one-time code: an address with ``?webmap_code=`` signs in once."""
        return self._security.new_code()

    async def _static(self, request: Request) -> Response:
        name = request.path_params["name"]
        return await answer_file(request, lambda: _read_static(name))

    async def _published_file(self, request: Request) -> Response:
        name = request.path_params["name"]
        return await answer_file(request, lambda: self.published.file(name))

    async def _published_image(self, request: Request) -> Response:
        tag = request.path_params["tag"]
        return await answer_file(
            request, lambda: self.published.image(tag), unchanging=True
        )


def create_app(
    site: Site,
    model: Model,
    gate: Gate,
    settings: Settings | None = None,
    *,
    published: Published | None = None,
    lifespan: Lifespan | None = None,
) -> WebApp:
    """Return the web application.

    Args:
        site: The pages there are.
        model: What owns the pages' contents.
        gate: What takes commands to robots.
        settings: Who may use it; a new token and this machine alone if not given.
        published: What the program publishes, if it has published already.
        lifespan: What to do when a server starts and stops the application, as
            Starlette has it; a host that mounts the application does it itself.

    Raises:
        ConfigError: If the settings' token is too short.

    """
    return WebApp(
        site,
        model,
        gate,
        settings or Settings(),
        published or Published(),
        lifespan,
    )


async def _key_fits(request: Request) -> Response:
    """Answer a page that asks why its socket was refused: this request was not."""
    del request
    return Response(status_code=204)


def _read_static(name: str) -> File:
    for folder in STATIC:
        try:
            return read_below(folder, name)
        except NoSuchFile:
            continue
    raise NoSuchFile


@asynccontextmanager
async def _nothing(app: Starlette) -> AsyncIterator[None]:
    del app
    yield


async def _answer_error(request: Request, error: Exception) -> Response:
    del request
    assert isinstance(error, HTTPException)
    texts = {
        404: "There is nothing at this address.",
        405: "This address can only be read.",
    }
    answer = plain(error.status_code, texts.get(error.status_code, error.detail))
    answer.headers.update(error.headers or {})
    return answer
