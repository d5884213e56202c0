"""Files and images that the program has a browser load, each by a URL of its own.

Nothing is found here by its path: only what was published is served. The program
publishes in its own thread while the web thread serves, hence the lock.
"""

import hashlib
import threading
from pathlib import Path
from urllib.parse import quote

from webmap.core import pictures as drawn
from webmap.core.pictures import Pictures
from webmap.errors import ConfigError
from webmap.server.files import MEDIA_TYPES, File, NoSuchFile, media_type_of, read_file

FILES = "/_webmap/files/"
IMAGES = drawn.PREFIX

_IMAGE_TYPES = {
    media_type.partition(";")[0]: media_type
    for media_type in MEDIA_TYPES.values()
    if media_type.startswith("image/")
}


class Published:
    """What the program has published.

    Every URL begins with ``/_webmap/``; the browser puts the prefix before it under
    which the application is mounted.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._files: dict[str, Path] = {}
        self._images = Pictures()

    def publish_file(self, path: Path) -> str:
        """Let browsers load a file, and return its URL.

        Files of one folder have one folder in their URLs, so that a published module
        can import a published neighbour by its relative name. The file is read at
        each request.

        Args:
            path: An ES module, a style sheet or an image.

        Raises:
            ConfigError: If there is no such file, or it is of another kind.

        """
        path = _existing(path)
        folder = hashlib.sha256(str(path.parent).encode("utf-8", "surrogateescape"))
        name = f"{folder.hexdigest()[:16]}/{path.name}"
        with self._lock:
            self._files[name] = path
        return FILES + quote(name)

    def publish_image(self, image: Path | bytes, media_type: str | None = None) -> str:
        """Let browsers load an image, and return a URL of this very version of it.

        The same content has the same URL, and a browser asks for it once; what was
        published twice is served until it was withdrawn twice.

        Args:
            image: A file, which is read now, or the bytes themselves.
            media_type: As ``"image/png"``; told by a file's suffix if not given.

        Raises:
            ConfigError: If there is no such file, or it is not of a kind of image
                that browsers know.

        """
        if isinstance(image, Path):
            file = _read(_existing(image))
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
        """Undo one :meth:`publish_image`; an unknown URL does nothing."""
        self._images.withdraw(url)

    def file(self, name: str) -> File:
        """Read a published file by its folder and name.

        Raises:
            NoSuchFile: If it was not published, or is gone.

        """
        path = self._files.get(name)
        if path is None:
            raise NoSuchFile
        return read_file(path)

    def image(self, tag: str) -> File:
        """Return a published image, or one that a layer of this process has drawn.

        Raises:
            NoSuchFile: If it was not published, or was withdrawn.

        """
        image = self._images.get(tag) or drawn.pictures.get(tag)
        if image is None:
            raise NoSuchFile
        return File(image.data, image.media_type, tag, image.fleeting)


def _existing(path: Path) -> Path:
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


def _read(path: Path) -> File:
    try:
        return read_file(path)
    except NoSuchFile as error:
        raise ConfigError(
            f"{str(path)!r} cannot be read, or has more than 64 MiB"
        ) from error
