"""Map tiles from this machine's disk: a folder, or an MBTiles file.

Nothing is ever requested from another host. Files are untrusted: their content is
limited in size and in time, and only pictures are passed on.
"""

import html
import re
import sqlite3
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

from webmap.base.errors import ConfigError

MAX_ZOOM = 24
"""Greatest level of a tile."""

LARGEST = 4 << 20
"""Greatest size of a tile, in bytes."""

WIDEST = 1024
"""Greatest side of a tile, in pixels."""

PATIENCE = 2.0
"""Greatest duration of a query to an MBTiles file, in seconds."""

MEDIA = {"png": "image/png", "jpeg": "image/jpeg", "webp": "image/webp"}
SUFFIXES = ("png", "jpg", "jpeg", "webp")
_HEADER = b"SQLite format 3\0"
_STEPS = 10_000


class Tile(NamedTuple):
    """The number of a tile: its level, x from west and y from north, as in web maps."""

    z: int
    x: int
    y: int


class Source(Protocol):
    """Where tiles come from: a folder, or an MBTiles file."""

    attribution: str

    @property
    def zooms(self) -> Sequence[int]:
        """The available levels, ascending."""

    def read(self, tile: Tile) -> tuple[bytes, str] | None:
        """Return a tile and its media type; None if there is none.

        Raises:
            ConfigError: If the content is not a tile.
        """


def open_tiles(source: str | Path) -> Source:
    """Return the source for a path.

    Args:
        source: A folder with ``z/x/y.png`` (or ``.jpg``, ``.webp``), or an MBTiles
            file.

    Raises:
        ConfigError: If it is neither, or contains no tiles that can be drawn.
    """
    if re.match(r"[A-Za-z][A-Za-z0-9+.-]+://", str(source)):
        raise ConfigError(
            f"tiles {str(source)!r}: tiles are read from this machine's disk alone: "
            "give a folder with z/x/y.png, or an MBTiles file"
        )
    path = Path(source).absolute()
    try:
        if path.is_dir():
            return FolderTiles(path)
        if path.is_file():
            return MBTiles(path)
    except OSError as error:
        raise ConfigError(
            f"tiles {str(source)!r} cannot be read: {error.strerror}"
        ) from None
    raise ConfigError(
        f"tiles {str(source)!r}: there is no such folder and no such file"
    )


class FolderTiles:
    """A folder with ``z/x/y.png``.

    Args:
        folder: The folder.

    Raises:
        ConfigError: If the folder contains no level.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        self.attribution = ""
        names = [entry.name for entry in self.folder.iterdir() if entry.is_dir()]
        levels = {int(name) for name in names if re.fullmatch(r"[0-9]{1,2}", name)}
        self.zooms: Sequence[int] = sorted(
            level for level in levels if level <= MAX_ZOOM
        )
        if not self.zooms:
            raise ConfigError(
                f"tiles {str(folder)!r}: there is no folder of a level in it, such as "
                "15/17600/11100.png"
            )

    def read(self, tile: Tile) -> tuple[bytes, str] | None:
        """Return a tile and its media type; None if there is none.

        Raises:
            ConfigError: If the file is not a tile, or is outside of the folder.
        """
        for suffix in SUFFIXES:
            file = self.folder / f"{tile.z}" / f"{tile.x}" / f"{tile.y}.{suffix}"
            try:
                real = file.resolve(strict=True)
            except (OSError, RuntimeError):  # missing, or a cycle of links
                continue
            if not real.is_relative_to(self.folder):
                raise ConfigError(f"{file} leads out of {self.folder}")
            if not real.is_file():
                raise ConfigError(f"{file} is not a file")
            with real.open("rb") as stream:
                data = stream.read(LARGEST + 1)
            return data, media_type(data, str(file))
        return None


class MBTiles:
    """An MBTiles file: an SQLite database with a picture for each tile.

    Args:
        file: The file.

    Raises:
        ConfigError: If it is not an MBTiles file, or contains no pictures.
    """

    def __init__(self, file: Path) -> None:
        self.file = file
        self._lock = threading.Lock()
        if not file.is_file():
            raise ConfigError(f"tiles {str(file)!r}: expected a folder or a file")
        with file.open("rb") as stream:
            if stream.read(len(_HEADER)) != _HEADER:
                raise ConfigError(f"tiles {str(file)!r}: this is not an MBTiles file")
        # Read only, and never with another process's journal or log.
        address = f"{file.resolve().as_uri()}?mode=ro&immutable=1"
        self._database = sqlite3.connect(address, uri=True, check_same_thread=False)
        try:
            self._read_metadata()
        except ConfigError:
            self.close()
            raise

    def _read_metadata(self) -> None:
        self._database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST)
        self._database.setlimit(sqlite3.SQLITE_LIMIT_ATTACHED, 0)
        # tables may be views; the functions in them must be harmless
        self._database.execute("PRAGMA trusted_schema=OFF")
        self._database.execute("PRAGMA cell_size_check=ON")
        self._deadline = 0.0
        self._database.set_progress_handler(self._is_late, _STEPS)
        known = dict(self._ask("SELECT name, value FROM metadata LIMIT 100"))
        form = str(known.get("format", "png")).lower()
        if form in ("pbf", "mvt"):
            raise ConfigError(
                f"tiles {str(self.file)!r}: vector tiles cannot be drawn; expected "
                "png, jpg or webp"
            )
        self.attribution = plain(str(known.get("attribution") or ""))
        self.zooms: Sequence[int] = self._levels(known)

    def close(self) -> None:
        """Close the database, after a tile that another thread reads now."""
        with self._lock:
            self._database.close()

    def read(self, tile: Tile) -> tuple[bytes, str] | None:
        """Return a tile and its media type; None if there is none.

        Raises:
            ConfigError: If the file does not answer in time, or the content is not a
                picture.
        """
        rows = self._ask(
            "SELECT tile_data FROM tiles "
            "WHERE zoom_level = ? AND tile_column = ? AND tile_row = ? LIMIT 1",
            # MBTiles counts rows from the south.
            (tile.z, tile.x, 2**tile.z - 1 - tile.y),
        )
        if not rows or rows[0][0] is None:
            return None
        data = rows[0][0]
        name = f"{self.file.name} {tile.z}/{tile.x}/{tile.y}"
        if not isinstance(data, bytes):
            raise ConfigError(f"{name}: got {type(data).__name__}, expected a picture")
        return data, media_type(data, name)

    def _levels(self, known: dict[str, object]) -> Sequence[int]:
        try:
            low, high = (int(str(known[name])) for name in ("minzoom", "maxzoom"))
        except (KeyError, ValueError):
            # Two single queries use the index; one query for both reads every row.
            ((low, high),) = self._ask(
                "SELECT (SELECT MIN(zoom_level) FROM tiles), "
                "(SELECT MAX(zoom_level) FROM tiles)"
            )
        if not (isinstance(low, int) and isinstance(high, int)) or low > high:
            raise ConfigError(f"tiles {str(self.file)!r}: there are no tiles in it")
        return range(max(low, 0), min(high, MAX_ZOOM) + 1)

    def _ask(self, question: str, values: tuple[int, ...] = ()) -> list[tuple]:  # type: ignore[type-arg]
        with self._lock:
            self._deadline = time.monotonic() + PATIENCE
            try:
                return self._database.execute(question, values).fetchall()
            except (sqlite3.Error, OverflowError, UnicodeError) as error:
                raise ConfigError(f"tiles {str(self.file)!r}: {error}") from None

    def _is_late(self) -> bool:
        return time.monotonic() > self._deadline


def media_type(data: bytes, name: str) -> str:
    """Return the media type of a tile that browsers can draw.

    Raises:
        ConfigError: If browsers cannot draw it, or it is too large.
    """
    import io

    from PIL import Image, UnidentifiedImageError

    if len(data) > LARGEST:
        raise ConfigError(f"{name} has more than {LARGEST >> 20} MiB")
    try:
        with Image.open(io.BytesIO(data), formats=["PNG", "JPEG", "WEBP"]) as image:
            form, (width, height) = str(image.format).lower(), image.size
    except (UnidentifiedImageError, OSError, ValueError, Image.DecompressionBombError):
        raise ConfigError(f"{name} is not a PNG, JPEG or WebP") from None
    if max(width, height) > WIDEST:
        raise ConfigError(
            f"{name} has {width} x {height} pixels, expected {WIDEST} on a side at most"
        )
    return MEDIA[form]


def plain(text: str) -> str:
    """Return the text of an attribution without its markup, in one line."""
    text = html.unescape(re.sub(r"<[^<>]*>", "", text[:2000]))
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())[:300]
