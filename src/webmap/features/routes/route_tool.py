"""Routes: the selected robot drives from goal to goal."""

import asyncio
import hashlib
import logging
import re
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.plain_files import LARGEST_STATE, read_file, write_file
from webmap.base.roles import Role
from webmap.base.tasks import spawn
from webmap.core.map import Map
from webmap.core.registry import map_modules
from webmap.gate.locks import state_folder

log = logging.getLogger("webmap.modules.route_tool")

MOST_ROUTES = 200
MOST_POINTS = 500
LONGEST_NAME = 60
FARTHEST = 1e6
"""Greatest coordinate of a goal in metres; the gate refuses farther goals."""


class Waypoint(msgspec.Struct, forbid_unknown_fields=True):
    """A goal: metres and radians in the frame of the map."""

    x: float
    y: float
    yaw: float


class Route(msgspec.Struct, forbid_unknown_fields=True):
    """Goals in order."""

    points: list[Waypoint]
    loop: bool = False
    """Whether the first goal follows the last."""


class RouteFile(msgspec.Struct, forbid_unknown_fields=True):
    """The content of a file: routes by name, on one map."""

    map: str
    routes: dict[str, Route] = {}


def read_name(value: Any) -> str:
    """Return the name of a route.

    Raises:
        ConfigError: If the name is not valid.
    """
    name = value.strip() if isinstance(value, str) else ""
    if not name or len(name) > LONGEST_NAME or not name.isprintable():
        raise ConfigError(f"a route's name has 1 to {LONGEST_NAME} letters in one line")
    return name


def read_route(value: Any) -> Route:
    """Return a route from a page's message.

    Raises:
        ConfigError: If the route is not valid.
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
        # Written so that NaN is refused too.
        if not all(abs(n) <= FARTHEST for n in (point.x, point.y, point.yaw)):
            raise ConfigError(f"expected x, y, heading up to {FARTHEST:g}, got {point}")
    return route


class RouteStore:
    """The stored routes of one map; may be used by any thread.

    Args:
        folder: The folder of the files.
        map: The name of the map.
    """

    _lock = threading.Lock()
    """One lock for all stores, because two pages may show one map."""

    def __init__(self, folder: Path, map: str) -> None:
        plain = re.sub(r"[^a-z0-9]+", "-", map.lower()).strip("-")[:40] or "map"
        digest = hashlib.sha256(map.encode()).hexdigest()[:8]
        self.file = folder / f"{plain}-{digest}.json"
        self._map = map

    def names(self) -> list[str]:
        """Return the names of the stored routes.

        Raises:
            ConfigError: If the file cannot be read.
        """
        return sorted(self._read().routes, key=str.casefold)

    def load(self, name: str) -> Route:
        """Return a route.

        Raises:
            ConfigError: If there is no route of that name, or the file cannot be read.
        """
        found = self._read().routes.get(name)
        if found is None:
            raise ConfigError(f"there is no route {name!r}")
        return found

    def save(self, name: str, route: Route) -> None:
        """Store a route; it replaces a route of the same name.

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
        """Delete a route; does nothing if there is no route of that name.

        Raises:
            ConfigError: If the file cannot be read or written.
        """
        with self._lock:
            saved = self._read()
            if saved.routes.pop(name, None) is not None:
                self._write(saved)

    def _read(self) -> RouteFile:
        try:
            return msgspec.json.decode(
                read_file(self.file, LARGEST_STATE, links=False), type=RouteFile
            )
        except FileNotFoundError:
            return RouteFile(self._map)
        except (OSError, msgspec.DecodeError, RecursionError) as error:
            # The file stays unchanged, so that a person can repair it.
            raise ConfigError(f"{self.file} cannot be read: {error}") from error

    def _write(self, saved: RouteFile) -> None:
        text = msgspec.json.format(msgspec.json.encode(saved), indent=2)
        try:
            write_file(self.file, text)
        except OSError as error:
            raise ConfigError(f"{self.file} cannot be written: {error}") from error


@map_modules.register
class RouteTool:
    """Routes of waypoints: drawn on the map, stored by name, driven by a robot.

    An area on the map becomes waypoints of sweeps over it, only in the page.

    The page sends one goal after the other, while it has control: a route continues
    only as long as its page is open. Routes are stored on the server, in WebMap's state
    folder, for each map.

    Args:
        map: The map.
        name: The name of the map; routes of maps with other names are not offered. By
            default the path of the page.
    """

    MAY_SEND: ClassVar[Mapping[str, Role]] = {
        "load": "viewer",
        "save": "operator",
        "delete": "operator",
    }

    def __init__(self, map: Map, name: str | None = None) -> None:
        self.map = map
        self._store = RouteStore(
            state_folder() / "routes", name or f"page {map.page.entry.path}"
        )
        self.browser_part = map.add_browser_part(
            self,
            "features/routes/route_tool.js",
            {"saves": map.page.viewer.role != "viewer"},
            "features/routes/route_tool.css",
        )

    def on_ready(self) -> None:
        """Send the page the names of the routes."""
        self._do(lambda: None)

    def on_message(self, message: dict[str, Any]) -> None:
        """Store, load or delete a route for the page."""
        op = message.get("op")
        if op == "load":
            self._do(lambda: self._load(read_name(message.get("name"))))
        elif op not in ("save", "delete"):
            log.warning("%r: an unknown message of the page was ignored", self.map)
        elif self.map.page.viewer.role == "viewer":
            self.browser_part.send({"problem": "Only operators can change routes."})
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
        """Do work on the file in a thread, and send the page the result."""

        async def do() -> None:
            try:
                answer = await asyncio.to_thread(work) or {}
                names = await asyncio.to_thread(self._store.names)
                self.browser_part.send({**answer, "routes": names})
            except ConfigError as error:
                self.browser_part.send({"problem": str(error)})

        spawn(do())
