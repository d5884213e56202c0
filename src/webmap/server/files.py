"""Reading files that a browser asks for, and never any other.

A name is looked at before the file system is: only plain parts, only suffixes that
are listed. Then it is resolved, links too, and what it leads to must be a regular
file inside the folder.
"""

import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

MAX_BYTES = 64 * 1024 * 1024

MEDIA_TYPES: Mapping[str, str] = {
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".mjs": "text/javascript; charset=utf-8",
    ".bmp": "image/bmp",
    ".gif": "image/gif",
    ".ico": "image/x-icon",
    ".jpeg": "image/jpeg",
    ".jpg": "image/jpeg",
    ".png": "image/png",
    ".svg": "image/svg+xml; charset=utf-8",
    ".webp": "image/webp",
}
"""What may be served, by suffix; a table of our own, for the machine's may differ."""


class NoSuchFile(Exception):
    """There is no file of that name that may be served."""


@dataclass(frozen=True, slots=True)
class File:
    """A file that was read."""

    data: bytes
    media_type: str
    tag: str
    """Changes when the file does; without quotes."""
    fleeting: bool = False
    """Whether it is worth no room in a browser's store."""


def media_type_of(path: Path) -> str | None:
    """Return the media type of a file that may be served, None of any other."""
    return MEDIA_TYPES.get(path.suffix.lower())


def read_below(folder: Path, name: str) -> File:
    """Read a file below a folder.

    Args:
        folder: The only place where files are looked for.
        name: The rest of a URL's path, decoded, with ``/`` between its parts.

    Raises:
        NoSuchFile: If the name is not plain, its suffix is not one of
            :data:`MEDIA_TYPES`, or there is no such regular file inside ``folder``.

    """
    parts = name.split("/")
    if not all(map(_is_plain, parts)):
        raise NoSuchFile
    try:
        root = folder.resolve(strict=True)
        path = root.joinpath(*parts).resolve(strict=True)
    except (OSError, RuntimeError, ValueError):
        raise NoSuchFile from None
    if not path.is_relative_to(root):
        raise NoSuchFile
    return read_file(path)


def read_file(path: Path) -> File:
    """Read a file whose path is already known to be right.

    Raises:
        NoSuchFile: If its suffix is not one of :data:`MEDIA_TYPES`, it is not a
            regular file, or it has more than 64 MiB.

    """
    media_type = media_type_of(path)
    if media_type is None:
        raise NoSuchFile
    # A link put there since the path was resolved is not followed, and a FIFO does
    # not block.
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    flags |= getattr(os, "O_BINARY", 0)
    try:
        with open(os.open(path, flags), "rb") as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode) or status.st_size > MAX_BYTES:
                raise NoSuchFile
            data = file.read(MAX_BYTES)
    except OSError:
        raise NoSuchFile from None
    return File(data, media_type, f"{status.st_mtime_ns:x}-{status.st_size:x}")


def _is_plain(part: str) -> bool:
    # A dot at the start is a hidden file, ".." or "."; a colon is a drive or a stream.
    return bool(part) and not part.startswith(".") and not set(part) & set("\\:\0")
