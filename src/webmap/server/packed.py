"""Answers compressed with gzip, each content once."""

import gzip
import re
import threading
from collections import OrderedDict

LEAST_BYTES = 500
MOST_BYTES = 8 * 1024 * 1024
"""Sizes of what is compressed: less fits into one packet, more takes too long."""

MOST_STORED_BYTES = 32 * 1024 * 1024

_TYPES = ("text/", "application/json", "image/svg+xml", "image/bmp")
"""Other images are compressed already."""

_GZIP = re.compile(r"\s*gzip\s*(?:;\s*q\s*=\s*(?!0(?:\.0*)?\s*$)[0-9.]+\s*)?")


def accepts_gzip(accept_encoding: str) -> bool:
    """Return whether a browser with this header Accept-Encoding reads gzip."""
    return any(map(_GZIP.fullmatch, accept_encoding.split(",")))


def may_pack(media_type: str, size: int) -> bool:
    """Return whether content of a type and a size in bytes is worth compressing."""
    return media_type.startswith(_TYPES) and LEAST_BYTES <= size <= MOST_BYTES


class Packed:
    """Compresses each content once and stores the result; for any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._stored: OrderedDict[bytes, bytes] = OrderedDict()
        self._bytes = 0

    def of(self, data: bytes) -> bytes:
        """Return the content compressed."""
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
