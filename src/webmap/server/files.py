"""The files that a browser may load: those below a folder, and published ones.

The name of a file below a folder is checked before the file system is used: only plain
parts and listed suffixes are accepted. Then links are resolved, and the result must be
a regular file inside the folder. Published files are found by their URL only. Answers
are compressed with gzip, each content once.
"""

import gzip
import hashlib
import os
import re
import stat
import threading
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from webmap.base.errors import ConfigError
from webmap.core import pictures as drawn
from webmap.core.pictures import Pictures

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
    ".webmanifest": "application/manifest+json",
}
"""The served file types by suffix; a fixed table, since the machine's may differ."""

FILES = "/_webmap/files/"
IMAGES = drawn.PREFIX

_IMAGE_TYPES = {
    media_type.partition(";")[0]: media_type
    for media_type in MEDIA_TYPES.values()
    if media_type.startswith("image/")
}


class NoSuchFile(Exception):
    """There is no file of that name that may be served."""


@dataclass(frozen=True, slots=True)
class File:
    """A file that was read."""

    data: bytes
    media_type: str
    tag: str
    """Changes with the file; without quotes."""
    fleeting: bool = False
    """Whether browsers should not cache it."""
    unchanging: bool = False
    """Whether its URL always has the same content."""


def media_type_of(path: Path) -> str | None:
    """Return the media type of a file that may be served, None for any other."""
    return MEDIA_TYPES.get(path.suffix.lower())


def read_below(folder: Path, name: str) -> File:
    """Read a file below a folder.

    Args:
        folder: The folder.
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
    """Read a file whose path was already checked.

    Raises:
        NoSuchFile: If its suffix is not one of :data:`MEDIA_TYPES`, it is not a regular
            file, or it has more than 64 MiB.

    """
    media_type = media_type_of(path)
    if media_type is None:
        raise NoSuchFile
    # A link created after the path was resolved is not followed, and a FIFO does not
    # block.
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
    # A dot at the start means a hidden file, ".." or "."; a colon a drive or a stream.
    return bool(part) and not part.startswith(".") and not set(part) & set("\\:\0")


class Published:
    """Files and images that the program has published, each with its own URL.

    The program publishes in its own thread while the web thread serves, hence the lock.

    Every URL begins with ``/_webmap/``; the browser adds the prefix under which the
    application is mounted.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._files: dict[str, Path] = {}
        self._images = Pictures()

    def publish_file(self, path: Path) -> str:
        """Let browsers load a file, and return its URL.

        Files of one folder have the same folder in their URLs, so that a published
        module can import another one by its relative name. The file is read at each
        request.

        Args:
            path: An ES module, a style sheet or an image.

        Raises:
            ConfigError: If there is no such file, or it has another type.

        """
        path = _checked_path(path)
        folder = hashlib.sha256(str(path.parent).encode("utf-8", "surrogateescape"))
        name = f"{folder.hexdigest()[:16]}/{path.name}"
        with self._lock:
            self._files[name] = path
        return FILES + quote(name)

    def publish_image(self, image: Path | bytes, media_type: str | None = None) -> str:
        """Let browsers load an image, and return a URL of this exact version of it.

        The same content has the same URL, and a browser requests it once. An image that
        was published twice is served until it was withdrawn twice.

        Args:
            image: A file, which is read now, or the bytes themselves.
            media_type: Such as ``"image/png"``; taken from a file's suffix if not
                given.

        Raises:
            ConfigError: If there is no such file, or it is not an image type that
                browsers support.

        """
        if isinstance(image, Path):
            file = _read_or_raise(_checked_path(image))
            data, media_type = file.data, media_type or file.media_type
        else:
            data = bytes(image)
        known = _IMAGE_TYPES.get((media_type or "").partition(";")[0])
        if known is None:
            raise ConfigError(
                f"an image is one of {', '.join(sorted(_IMAGE_TYPES))}, "
                f"got {media_type!r}"
            )
        return self._images.publish(data, known)

    def withdraw_image(self, url: str) -> None:
        """Undo one :meth:`publish_image`; does nothing for an unknown URL."""
        self._images.withdraw(url)

    def file(self, name: str) -> File:
        """Read a published file by its folder and name.

        Raises:
            NoSuchFile: If it was not published, or was deleted.

        """
        path = self._files.get(name)
        if path is None:
            raise NoSuchFile
        return read_file(path)

    def image(self, tag: str) -> File:
        """Return a published image, or an image that a layer of this process drew.

        Raises:
            NoSuchFile: If it was not published, or was withdrawn.

        """
        image = self._images.get(tag) or drawn.pictures.get(tag)
        if image is None:
            raise NoSuchFile
        return File(image.data, image.media_type, tag, image.fleeting, unchanging=True)


def _checked_path(path: Path) -> Path:
    try:
        resolved = path.resolve(strict=True)
    except (OSError, RuntimeError, ValueError) as error:
        raise ConfigError(f"there is no file {str(path)!r}") from error
    if not resolved.is_file():
        raise ConfigError(f"{str(path)!r} is not a file")
    if media_type_of(resolved) is None:
        raise ConfigError(
            f"a browser may load {' '.join(MEDIA_TYPES)}, not {str(path)!r}"
        )
    return resolved


def _read_or_raise(path: Path) -> File:
    try:
        return read_file(path)
    except NoSuchFile as error:
        raise ConfigError(
            f"{str(path)!r} cannot be read, or has more than 64 MiB"
        ) from error


LEAST_COMPRESSED_BYTES = 500
MOST_COMPRESSED_BYTES = 8 * 1024 * 1024
"""Sizes of what is compressed: less fits into one packet, more takes too long."""

MOST_STORED_BYTES = 32 * 1024 * 1024

_COMPRESSED_TYPES = ("text/", "application/json", "image/svg+xml", "image/bmp")
"""Other images are compressed already."""

_GZIP = re.compile(r"\s*gzip\s*(?:;\s*q\s*=\s*(?!0(?:\.0*)?\s*$)[0-9.]+\s*)?")


def accepts_gzip(accept_encoding: str) -> bool:
    """Return whether a browser with this header Accept-Encoding reads gzip."""
    return any(map(_GZIP.fullmatch, accept_encoding.split(",")))


def is_worth_compressing(media_type: str, size: int) -> bool:
    """Return whether content of a type and a size in bytes is worth compressing."""
    return (
        media_type.startswith(_COMPRESSED_TYPES)
        and LEAST_COMPRESSED_BYTES <= size <= MOST_COMPRESSED_BYTES
    )


class GzipCache:
    """Compresses each content once and stores the result; for any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._stored: OrderedDict[bytes, bytes] = OrderedDict()
        self._bytes = 0

    def compressed(self, data: bytes) -> bytes:
        """Return ``data`` compressed with gzip, each content once."""
        # Also while another thread compresses: it may be compressing the same.
        with self._lock:
            packed = self._stored.get(data)
            if packed is None:
                packed = gzip.compress(data, mtime=0)
                self._stored[data] = packed
                self._bytes += len(data) + len(packed)
                while self._bytes > MOST_STORED_BYTES:
                    self._bytes -= sum(map(len, self._stored.popitem(last=False)))
            else:
                self._stored.move_to_end(data)
            return packed
