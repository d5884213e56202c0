"""Routes that were saved, by name, in a file for each map."""

import hashlib
import re
import threading
from pathlib import Path
from typing import Any

import msgspec

from webmap.errors import ConfigError
from webmap.plain_files import LARGEST_STATE, read_file, write_file

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
        raise ConfigError(f"this is no route: {error}") from error
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
