"""Images that are drawn in this process and shown by URL, without any file.

The model's thread publishes and the web thread serves, hence the lock.
"""

import hashlib
import threading
import time
from collections import deque
from pathlib import Path
from typing import NamedTuple, Protocol

from webmap.base.geometry import Affine
from webmap.base.scope import Removal, keep
from webmap.scene import svg

KEPT_FOR = 3.0
"""Seconds for which a picture is served after another took its place."""

MOST_KEPT = 64
"""How many of them, so that what changes often does not pile up."""

RETIRED_BYTES = 8 << 20
"""The most bytes of retired pictures that pages may still load."""

PREFIX = "/_webmap/images/"
"""How the URL of every image begins that has no name of its own."""


def pixels_across(file: Path) -> int | None:
    """Return how many pixels wide an image is; None if its file does not tell."""
    from PIL import Image

    try:
        with Image.open(file) as image:
            return image.width
    except (OSError, ValueError, Image.DecompressionBombError):
        return None


class Publisher(Protocol):
    """Gives files URLs that a page can load; the server implements it."""

    def publish_file(self, path: Path) -> str:
        """Let pages load an ES module or a style sheet; return its URL."""

    def publish_image(self, image: Path) -> str:
        """Let pages load an image; return the URL of this version of it."""

    def withdraw_image(self, url: str) -> None:
        """Undo one :meth:`publish_image`."""


class Published(NamedTuple):
    """An image as it is served."""

    data: bytes
    media_type: str
    fleeting: bool = False
    """Whether another takes its place at once, so that no browser need keep it."""


class Pictures:
    """Images by what is in them: the same content has the same URL."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._images: dict[str, Published] = {}
        self._uses: dict[str, int] = {}
        self._retired: dict[str, tuple[Published, float]] = {}
        """For each tag the image and when it was retired, the oldest first."""

    def __len__(self) -> int:
        return len(self._images)

    def publish(
        self, data: bytes, media_type: str = "image/png", *, fleeting: bool = False
    ) -> str:
        """Let pages load an image until it was withdrawn as often; return its URL."""
        # The quickest that cannot be forged; the data may be a large map.
        found = hashlib.blake2b(media_type.encode() + b"\0", digest_size=16)
        found.update(data)
        tag = found.hexdigest()
        with self._lock:
            self._images.setdefault(tag, Published(data, media_type, fleeting))
            self._uses[tag] = self._uses.get(tag, 0) + 1
        return PREFIX + tag

    def withdraw(self, url: str) -> None:
        """Undo one :meth:`publish`; an unknown URL does nothing."""
        tag = url.removeprefix(PREFIX)
        with self._lock:
            uses = self._uses.pop(tag, 0) - 1
            if uses > 0:
                self._uses[tag] = uses
            else:
                self._images.pop(tag, None)

    def retire(self, url: str) -> None:
        """Withdraw an image, but let pages load it for ``KEPT_FOR`` seconds more.

        A page that is a little behind still asks for what is no longer shown.
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
                if size <= RETIRED_BYTES and now - since <= KEPT_FOR:
                    break
                del self._retired[name]
                size -= len(old.data)

    def get(self, tag: str) -> Published | None:
        """Return the image whose URL ends in ``tag``, if pages may load it."""
        with self._lock:
            if tag in self._images:
                return self._images[tag]
            image, since = self._retired.get(tag, (None, 0.0))
            return image if time.monotonic() - since <= KEPT_FOR else None


pictures = Pictures()
"""What the layers of this process have drawn."""


class Picture:
    """An ``<image>`` in the world whose content is drawn here, again and again.

    It ends with the scope that it was made in.
    """

    def __init__(self) -> None:
        self.element = svg.image(preserveAspectRatio="none")
        self._urls: deque[tuple[str, float]] = deque()
        keep(Removal(self._end))

    def show(
        self, data: bytes, matrix: Affine, width: float, height: float, cell: float
    ) -> None:
        """Show a PNG in place of the one before.

        Args:
            data: The PNG.
            matrix: From the image, in metres with x right and y down from its top
                left corner, to what the element is in.
            width: In metres.
            height: In metres.
            cell: How wide one of its pixels is, in metres.

        """
        now = time.monotonic()
        self._urls.append((pictures.publish(data), now))
        self.element.set(href=self._urls[-1][0], width=width, height=height)
        self.element.set("data-cell", cell)
        self.element.set_matrix(matrix)
        # A page that is a little behind still asks for those before.
        while len(self._urls) > 2 and (
            now - self._urls[0][1] > KEPT_FOR or len(self._urls) > MOST_KEPT
        ):
            pictures.withdraw(self._urls.popleft()[0])

    def clear(self) -> None:
        """Show nothing."""
        self.element.unset("href")
        self._end()

    def _end(self) -> None:
        while self._urls:
            pictures.retire(self._urls.popleft()[0])
