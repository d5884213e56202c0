"""The selected robot goes from place to place."""

import asyncio
import hashlib
import logging
import re
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.plain_files import LARGEST_STATE, read_file, write_file
from webmap.base.tasks import spawn
from webmap.core.registry import map_modules
from webmap.gate.kept.locks import state_folder

if TYPE_CHECKING:
    from webmap.core.map import Map

log = logging.getLogger("webmap.modules.route_tool")

MOST_ROUTES = 200
MOST_POINTS = 500
LONGEST_NAME = 60
FARTHEST = 1e6
"""Metres from the origin along an axis; the gate takes no goal that is farther."""


class Waypoint(msgspec.Struct, forbid_unknown_fields=True):
    """A pose to go to: metres and radians in the frame of the map."""

    x: float
    y: float
    yaw: float


class Route(msgspec.Struct, forbid_unknown_fields=True):
    """Poses in the order in which they are gone to."""

    points: list[Waypoint]
    loop: bool = False
    """Whether the first comes after the last."""


class Saved(msgspec.Struct, forbid_unknown_fields=True):
    """What a file holds."""

    map: str
    routes: dict[str, Route] = {}


def read_name(value: Any) -> str:
    """Return the name of a route.

    Raises:
        ConfigError: If it is none.

    """
    name = value.strip() if isinstance(value, str) else ""
    if not name or len(name) > LONGEST_NAME or not name.isprintable():
        raise ConfigError(f"a route's name has 1 to {LONGEST_NAME} letters in one line")
    return name


def read_route(value: Any) -> Route:
    """Return a route as a page sends it.

    Raises:
        ConfigError: If it is none.

    """
    try:
        route = msgspec.convert(value, Route)
    except msgspec.ValidationError as error:
        raise ConfigError(f"not a route: {error}") from error
    if not 1 <= len(route.points) <= MOST_POINTS:
        raise ConfigError(
            f"a route has 1 to {MOST_POINTS} points, got {len(route.points)}"
        )
    for point in route.points:
        # Written so that NaN fails it too.
        if not all(abs(n) <= FARTHEST for n in (point.x, point.y, point.yaw)):
            raise ConfigError(f"this is no point to go to: {point}")
    return route


class RouteStore:
    """The routes of one map, on disk; may be used by any thread.

    Args:
        folder: Where the files are.
        map: What the map is called.

    """

    _lock = threading.Lock()
    """Of all, as two pages may show one map."""

    def __init__(self, folder: Path, map: str) -> None:
        plain = re.sub(r"[^a-z0-9]+", "-", map.lower()).strip("-")[:40] or "map"
        digest = hashlib.sha256(map.encode()).hexdigest()[:8]
        self.file = folder / f"{plain}-{digest}.json"
        self._map = map

    def names(self) -> list[str]:
        """Return the names of the routes there are.

        Raises:
            ConfigError: If the file cannot be read.

        """
        return sorted(self._read().routes, key=str.casefold)

    def load(self, name: str) -> Route:
        """Return a route.

        Raises:
            ConfigError: If there is none of that name, or the file cannot be read.

        """
        found = self._read().routes.get(name)
        if found is None:
            raise ConfigError(f"there is no route {name!r}")
        return found

    def save(self, name: str, route: Route) -> None:
        """Keep a route, in place of one of the same name.

        Raises:
            ConfigError: If there are too many, or the file cannot be read or written.

        """
        with self._lock:
            saved = self._read()
            saved.routes[name] = route
            if len(saved.routes) > MOST_ROUTES:
                raise ConfigError(
                    f"there are {MOST_ROUTES} routes already: delete one first"
                )
            self._write(saved)

    def delete(self, name: str) -> None:
        """Forget a route; nothing happens if there is none of that name.

        Raises:
            ConfigError: If the file cannot be read or written.

        """
        with self._lock:
            saved = self._read()
            if saved.routes.pop(name, None) is not None:
                self._write(saved)

    def _read(self) -> Saved:
        try:
            return msgspec.json.decode(read_file(self.file, LARGEST_STATE), type=Saved)
        except FileNotFoundError:
            return Saved(self._map)
        except (OSError, msgspec.DecodeError, RecursionError) as error:
            # It is left as it is: somebody may be able to mend it.
            raise ConfigError(f"{self.file} cannot be read: {error}") from error

    def _write(self, saved: Saved) -> None:
        text = msgspec.json.format(msgspec.json.encode(saved), indent=2)
        try:
            write_file(self.file, text)
        except OSError as error:
            raise ConfigError(f"{self.file} cannot be written: {error}") from error


@map_modules.register
class RouteTool:
    """Routes of waypoints: drawn on the map, kept by name, gone along by a robot.

    An area that is drawn becomes waypoints of sweeps over it, in the page alone.

    The page sends one goal after the other, under the lease that it has: a route goes
    on only as long as its page is there. Routes are kept on the server, in the folder
    of WebMap's state, for each map.

    Args:
        map: The map.
        name: What the map is called; routes of maps of other names are not offered. The
            path of the page if not given.

    """

    def __init__(self, map: "Map", name: str | None = None) -> None:
        self.map = map
        self._store = RouteStore(
            state_folder() / "routes", name or f"page {map.page.entry.path}"
        )
        self.half = map.add_browser_half(
            self,
            "features/routes/route_tool.js",
            {"saves": map.page.viewer.role != "viewer"},
            "features/routes/route_tool.css",
        )

    def on_ready(self) -> None:
        """Tell the page which routes there are."""
        self._do(lambda: None)

    def on_message(self, message: dict[str, Any]) -> None:
        """Keep, load or delete a route, as the page asks."""
        op = message.get("op")
        if op == "load":
            self._do(lambda: self._load(read_name(message.get("name"))))
        elif op not in ("save", "delete"):
            log.warning("%r: an unknown message of the page was ignored", self.map)
        elif self.map.page.viewer.role == "viewer":
            self.half.send({"problem": "Who may not drive may not change routes."})
        elif op == "save":
            self._do(lambda: self._save(message))
        else:
            self._do(lambda: self._store.delete(read_name(message.get("name"))))

    def _load(self, name: str) -> dict[str, Any]:
        route = msgspec.to_builtins(self._store.load(name))
        return {"loaded": {"name": name, **route}}

    def _save(self, message: dict[str, Any]) -> dict[str, Any]:
        name = read_name(message.get("name"))
        self._store.save(name, read_route(message.get("route")))
        return {"saved": name}

    def _do(self, work: Callable[[], dict[str, Any] | None]) -> None:
        """Do something with the file in a thread, and tell the page what came of it."""

        async def do() -> None:
            try:
                answer = await asyncio.to_thread(work) or {}
                names = await asyncio.to_thread(self._store.names)
                self.half.send({**answer, "routes": names})
            except ConfigError as error:
                self.half.send({"problem": str(error)})

        spawn(do())
