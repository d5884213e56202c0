"""How many pixels a compressed picture has, told from its head and not decoded.

A picture of a few kilobytes may have billions of pixels: whoever decodes it, a browser
too, runs out of memory. What a browser would have to search for is not searched for
here, so a picture whose size is not plain is refused.
"""

from webmap.errors import ProtocolError

MOST_SEGMENTS = 1000
"""Segments of a JPEG that are passed over before its size."""

_NO_FRAME = (0xC4, 0xC8, 0xCC)
"""Markers from 0xC0 to 0xCF that are no begin of a frame."""


def size_of(data: bytes) -> tuple[int, int]:
    """Return width and height of a JPEG, PNG or WebP, in pixels.

    Raises:
        ProtocolError: If it does not say, or says it in a place where it may not be.

    """
    if data.startswith(b"\xff\xd8"):
        size = _of_jpeg(data)
    elif data[12:16] == b"IHDR":
        size = _number(data[16:20]), _number(data[20:24])
    elif data[8:12] == b"WEBP":
        size = _of_webp(data)
    else:
        size = 0, 0
    if not (size[0] > 0 and size[1] > 0):
        raise ProtocolError("a picture whose head does not say how many pixels it has")
    return size


def _of_jpeg(data: bytes) -> tuple[int, int]:
    at = 2
    for _ in range(MOST_SEGMENTS):
        while data[at : at + 2] == b"\xff\xff":  # bytes that fill
            at += 1
        if len(data) < at + 9 or data[at] != 0xFF:
            break
        marker = data[at + 1]
        if 0xC0 <= marker <= 0xCF and marker not in _NO_FRAME:
            return _number(data[at + 7 : at + 9]), _number(data[at + 5 : at + 7])
        if marker in (0xD9, 0xDA):  # the end, or pixels without a frame
            break
        at += 2 + _number(data[at + 2 : at + 4])
    return 0, 0


def _of_webp(data: bytes) -> tuple[int, int]:
    kind, body = data[12:16], data[20:30]
    if len(body) < 10:
        return 0, 0
    if kind == b"VP8X":
        return 1 + _little(body[4:7]), 1 + _little(body[7:10])
    if kind == b"VP8L" and body[0] == 0x2F:
        bits = _little(body[1:5])
        return 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
    if kind == b"VP8 " and body[3:6] == b"\x9d\x01\x2a":
        return _little(body[6:8]) & 0x3FFF, _little(body[8:10]) & 0x3FFF
    return 0, 0


def _number(data: bytes) -> int:
    return int.from_bytes(data, "big")


def _little(data: bytes) -> int:
    return int.from_bytes(data, "little")
