"""Pictures that follow each other in one answer, as MJPEG has them. No I/O."""

from webmap.errors import ProtocolError
from webmap.ros.messages_image import MAX_BYTES

MAX_HEADERS = 8192
"""The longest that stands before one picture, in bytes."""


class Multipart:
    """Takes the bytes of a ``multipart/x-mixed-replace`` answer apart.

    Cameras differ in how they write it. The length of a part may be stated or not,
    lines may end with or without a carriage return, and the boundary may be named
    with the two dashes that only stand before it in the body.

    Args:
        boundary: What the answer's ``Content-Type`` names.

    Raises:
        ProtocolError: If no boundary is named.

    """

    def __init__(self, boundary: str) -> None:
        name = boundary.strip().strip('"').lstrip("-").encode("latin-1", "replace")
        if not name or len(name) > 200:
            raise ProtocolError("its answer names no boundary between pictures")
        self._mark = b"--" + name
        self._rest = bytearray()
        self._searched = 0
        self._in_part = False
        self._length: int | None = None

    def feed(self, data: bytes) -> list[bytes]:
        """Take in what came and return the pictures that are whole by it.

        Raises:
            ProtocolError: If it is too long for a picture, or not of this form.

        """
        self._rest += data
        pictures: list[bytes] = []
        while True:
            if not self._in_part and not self._begin():
                return pictures
            picture = self._picture()
            if picture is None:
                return pictures
            if picture:
                pictures.append(picture)

    def _begin(self) -> bool:
        """Go to the beginning of a picture; whether that is there yet."""
        at = self._rest.find(self._mark)
        if at < 0:
            if len(self._rest) > MAX_HEADERS:
                raise ProtocolError("its answer has no boundary between pictures")
            return False
        line = self._rest.find(b"\n", at)
        found = [(self._rest.find(end, line), len(end)) for end in _BLANK_LINES]
        ends = [(place, size) for place, size in found if line >= 0 and place >= 0]
        if not ends:
            if len(self._rest) - at > MAX_HEADERS:
                raise ProtocolError(f"more than {MAX_HEADERS} bytes before a picture")
            return False
        end, size = min(ends)
        self._length = _length(bytes(self._rest[line:end]))
        del self._rest[: end + size]
        self._in_part, self._searched = True, 0
        return True

    def _picture(self) -> bytes | None:
        rest = self._rest
        if self._length is not None:
            end = self._length if len(rest) >= self._length else -1
        else:
            # What was looked at is not looked at again, but for a torn mark.
            end = rest.find(self._mark, self._searched)
            self._searched = max(0, len(rest) - len(self._mark))
        if end < 0:
            if len(rest) > MAX_BYTES:
                raise ProtocolError(f"a picture of more than {MAX_BYTES} bytes")
            return None
        picture = bytes(rest[:end])
        if self._length is None:
            picture = picture.removesuffix(b"\n").removesuffix(b"\r")
        del rest[:end]
        self._in_part = False
        return picture


_BLANK_LINES = (b"\n\r\n", b"\n\n")


def _length(headers: bytes) -> int | None:
    """Return the stated length of a part, None if there is none.

    Raises:
        ProtocolError: If it is no length, or that of no picture.

    """
    for line in headers.splitlines():
        name, _, value = line.partition(b":")
        if name.strip().lower() != b"content-length":
            continue
        value = value.strip()
        # Some cameras state 0 where they do not know.
        if not value.isdigit() or len(value) > 12:
            raise ProtocolError(f"a picture of {value[:20]!r} bytes")
        if int(value) > MAX_BYTES:
            raise ProtocolError(f"a picture of {int(value)} bytes, {MAX_BYTES} at most")
        return int(value) or None
    return None
