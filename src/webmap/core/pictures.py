"""Images that this process draws and serves by URL, without files.

The model's thread publishes and the web thread serves, hence the lock.
"""

import hashlib
import threading
import time
from pathlib import Path
from typing import NamedTuple, Protocol

from webmap.base.geometry import Affine
from webmap.base.scope import Removal, keep
from webmap.scene import svg

KEPT_FOR = 3.0
"""Seconds for which a picture is still served after it was replaced."""

RETIRED_BYTES = 8 << 20
"""The greatest total size of such pictures, in bytes; the newest is always served."""

PREFIX = "/_webmap/images/"
"""The start of the URL of every image without a name."""


def pixels_across(file: Path) -> int | None:
    """Return the width of an image in pixels; None if its file cannot be read."""
    from PIL import Image

    try:
        with Image.open(file) as image:
            return image.width
    except (OSError, ValueError, Image.DecompressionBombError):
        return None


class Publisher(Protocol):
    """Gives files a URL that pages can load; implemented by the server."""

    def publish_file(self, path: Path) -> str:
        """Publish an ES module or a style sheet and return its URL."""

    def publish_image(self, image: Path) -> str:
        """Publish an image and return the URL of this version of it."""

    def withdraw_image(self, url: str) -> None:
        """Undo one :meth:`publish_image`."""


class PublishedImage(NamedTuple):
    """The content and the type of an image, as the web thread serves them."""

    data: bytes
    media_type: str
    fleeting: bool = False
    """Whether it is replaced at once, so that browsers need not cache it."""


class Pictures:
    """Images by content: the same content has the same URL."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._images: dict[str, PublishedImage] = {}
        self._uses: dict[str, int] = {}
        self._retired: dict[str, tuple[PublishedImage, float]] = {}
        """The image and the time of retirement for each tag, the oldest first."""

    def __len__(self) -> int:
        return len(self._images)

    def publish(
        self, data: bytes, media_type: str = "image/png", *, fleeting: bool = False
    ) -> str:
        """Publish an image until it was withdrawn as often; return its URL."""
        # The fastest hash that cannot be forged; the data may be a large map.
        found = hashlib.blake2b(media_type.encode() + b"\0", digest_size=16)
        found.update(data)
        tag = found.hexdigest()
        with self._lock:
            self._images.setdefault(tag, PublishedImage(data, media_type, fleeting))
            self._uses[tag] = self._uses.get(tag, 0) + 1
        return PREFIX + tag

    def withdraw(self, url: str) -> None:
        """Undo one :meth:`publish`; does nothing for an unknown URL."""
        tag = url.removeprefix(PREFIX)
        with self._lock:
            uses = self._uses.pop(tag, 0) - 1
            if uses > 0:
                self._uses[tag] = uses
            else:
                self._images.pop(tag, None)

    def retire(self, url: str) -> None:
        """Withdraw an image, but serve it for ``KEPT_FOR`` seconds more.

        A page with a slow connection may still request it.
        """
        now, tag = time.monotonic(), url.removeprefix(PREFIX)
        image = self.get(tag)
        self.withdraw(url)
        if image is None:
            return
        with self._lock:
            self._retired.pop(tag, None)
            self._retired[tag] = (image, now)
            size = sum(len(old.data) for old, _ in self._retired.values())
            for name, (old, since) in tuple(self._retired.items()):
                if name == tag or (size <= RETIRED_BYTES and now - since <= KEPT_FOR):
                    break
                del self._retired[name]
                size -= len(old.data)

    def get(self, tag: str) -> PublishedImage | None:
        """Return the image whose URL ends in ``tag``; None if pages may not load it."""
        with self._lock:
            if tag in self._images:
                return self._images[tag]
            image, since = self._retired.get(tag, (None, 0.0))
            return image if time.monotonic() - since <= KEPT_FOR else None


pictures = Pictures()
"""The pictures that the layers of this process drew."""


class Picture:
    """An ``<image>`` in the world whose content this process draws repeatedly.

    It ends with the scope in which it was created.
    """

    def __init__(self) -> None:
        self.element = svg.image(preserveAspectRatio="none")
        self._url: str | None = None
        keep(Removal(self._end))

    def show(
        self, data: bytes, matrix: Affine, width: float, height: float, cell: float
    ) -> None:
        """Replace the picture by a PNG.

        Args:
            data: The PNG.
            matrix: The transform from the image, in metres with x right and y down from
                its top left corner, to the parent of the element.
            width: In metres.
            height: In metres.
            cell: The width of one of its pixels, in metres.

        """
        earlier, self._url = self._url, pictures.publish(data)
        self.element.set(href=self._url, width=width, height=height)
        self.element.set("data-cell", cell)
        self.element.set_matrix(matrix)
        if earlier is not None:
            pictures.retire(earlier)

    def clear(self) -> None:
        """Show nothing."""
        self.element.unset("href")
        self._end()

    def _end(self) -> None:
        if self._url is not None:
            pictures.retire(self._url)
        self._url = None
