"""Images and videos that this process serves by URL, without files.

The model's thread publishes and the web thread serves, hence the locks.
"""

import hashlib
import secrets
import struct
import threading
import time
from collections.abc import Callable
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


VIDEOS = "/_webmap/video/"
"""The start of the URL of every video."""

MOST_PACKETS, MOST_PACKET_BYTES = 600, 4 << 20
"""The greatest number and size of the packets of a video since its last key picture,
which a new viewer gets. If there are more, it waits for the next key picture."""

KEY = 1
"""The first byte of a message with a key picture; 0 for all other pictures."""

_PICTURE = struct.Struct("<Bd")
_CONFIG = struct.Struct("<IIB")


class Viewing(NamedTuple):
    """How one viewer of a video is reached; both are called from any thread."""

    send: Callable[[bytes | str], None]
    """Sends a message: bytes with a picture, or a text for people."""

    end: Callable[[], None]
    """Called when the video has ended."""


class VideoStream:
    """A video that changes hands packet by packet, and its viewers.

    A message with a picture is, little-endian: 1 byte :data:`KEY` or 0; 8 bytes, when
    it was sent, as monotonic seconds; before a key picture, width and height with 4
    bytes each, 1 byte with the length of the codec's name, and this name; the packet.
    """

    def __init__(self, tag: str) -> None:
        self.url = VIDEOS + tag
        self._lock = threading.Lock()
        self._viewers: dict[object, Viewing] = {}
        self._packets: list[bytes] = []
        self._size = 0
        self._note = ""
        self._over = False

    def show(
        self, data: bytes, config: tuple[str, int, int] | None, stamp: float
    ) -> None:
        """Send a picture to all viewers.

        Args:
            data: The packet.
            config: Codec, width and height before a key picture; None for others.
            stamp: When it was sent, in monotonic seconds.

        """
        message = _PICTURE.pack(KEY if config else 0, stamp)
        if config is not None:
            codec, width, height = config
            name = codec.encode()
            message += _CONFIG.pack(width, height, len(name)) + name
        message += data
        with self._lock:
            size = self._size + len(message)
            full = len(self._packets) >= MOST_PACKETS or size > MOST_PACKET_BYTES
            if config is not None or full:
                self._packets, self._size = [], 0
            if config is not None or self._packets:
                self._packets.append(message)
                self._size += len(message)
            self._send(message)

    def lose(self) -> None:
        """Forget the kept packets: a new viewer waits for the next key picture."""
        with self._lock:
            self._packets, self._size = [], 0

    def tell(self, note: str) -> None:
        """Show a sentence with the video; an empty one removes it."""
        with self._lock:
            if note != self._note:
                self._note = note
                self._send(note)

    def join(self, viewing: Viewing) -> Removal:
        """Send a viewer what a decoder needs now, and all that follows."""
        key = object()
        with self._lock:
            if self._over:
                viewing.end()
            else:
                self._viewers[key] = viewing
                viewing.send(self._note)
                for message in self._packets:
                    viewing.send(message)
        return Removal(lambda: self._leave(key))

    def end(self) -> None:
        """End the video for all viewers."""
        with self._lock:
            self._over, viewers, self._viewers = True, self._viewers, {}
            self._packets = []
        videos.discard(self)
        for viewing in viewers.values():
            viewing.end()

    def _leave(self, key: object) -> None:
        with self._lock:
            self._viewers.pop(key, None)

    def _send(self, message: bytes | str) -> None:
        for viewing in self._viewers.values():
            viewing.send(message)


class Videos:
    """The videos that pages may show, each under a URL that nobody can guess."""

    def __init__(self) -> None:
        self._streams: dict[str, VideoStream] = {}

    def open(self) -> VideoStream:
        """Return a new video."""
        tag = secrets.token_hex(16)
        self._streams[tag] = stream = VideoStream(tag)
        return stream

    def discard(self, stream: VideoStream) -> None:
        """Forget a video that has ended."""
        self._streams.pop(stream.url.removeprefix(VIDEOS), None)

    def get(self, tag: str) -> VideoStream | None:
        """Return the video whose URL ends in ``tag``; None if there is none."""
        return self._streams.get(tag)


videos = Videos()
"""The videos of this process."""


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
