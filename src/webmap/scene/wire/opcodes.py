"""The table of the messages between the display and a page.

``tools/make_javascript.py`` writes the same table for the browser. All numbers are
little-endian. In the layouts below, ``v`` is a variable-length integer with seven bits
in each byte, lowest first, and ``s`` is UTF-8 text after its length as ``v``. ``u8``,
``u16``, ``u32``, ``i16``, ``f32`` and ``f64`` are unsigned integers, signed integers
and floats with that many bits.

A frame is a header followed by records. The header is ``u16 version``, ``u8 flags``,
``u32 frame`` and ``f64 now``: the version of this table, :data:`RESET` or 0, the number
that the page acknowledges, and the display's monotonic clock in seconds.
"""

import zlib
from enum import IntEnum
from functools import lru_cache

from webmap.scene.allowed import (
    ATTRIBUTES,
    BOOLEAN_ATTRIBUTES,
    EVENTS,
    HTML_TAGS,
    SVG_TAGS,
)

RESET = 1
"""Flag of a frame with the whole state: the page drops its earlier state."""

PREVENT, STOP = 1, 2
"""Flags of an event with a listener."""

LAST, FIRST, AFTER = 0, 1, 2
"""The place of a child: at the end, at the beginning, or after id (place - AFTER)."""

VIEW_OPERATIONS = ("translate", "scale", "rotate", "set", "fit", "follow")
"""Operations of a program on the view of a map."""

TAGS = SVG_TAGS + HTML_TAGS
"""The tags in the order of their numbers: first those of SVG, then those of HTML."""


class Op(IntEnum):
    """The first byte of a record; the comment lists the bytes after it."""

    # About the page.
    DELTA = 1  # v fragment: the element records that follow go to all its mounts
    SNAPSHOT = 2  # v mount: the element records that follow build this one mount
    MOUNT = 3  # v mount, v fragment, v within, v under, f64 order
    UNMOUNT = 4  # v mount
    MOUNT_CLASS = 5  # v mount, u8 on, s class
    LISTEN = 6  # v mount, v element, u8 event, u8 flags
    UNLISTEN = 7  # v mount, v element, u8 event
    # v svg, v session, v operations in it, u8 known, if known: 6 f64, v followed id
    VIEW_STATE = 8
    VIEW = 9  # v svg, v number, u8 operation, u8 count, count f64
    ATTACH = 10  # v svg, v instance, s module, s stylesheet, s options (JSON)
    DETACH = 11  # v instance
    MESSAGE = 12  # v instance, s message (JSON)
    ERROR = 13  # s text
    PROBLEM = 14  # v number, s text (empty: ended)

    # About elements; a place is LAST, FIRST or AFTER and the id of a sibling.
    CREATE = 32  # v id, v parent (0: the root), v place, u8 tag
    TEXT = 33  # v id, v parent, v place, s text
    DOCUMENT = 34  # v id
    BIND = 35  # v id, s id in the page
    REMOVE = 36  # v id
    ATTRIBUTE = 37  # v id, u8 name, s value
    UNSET = 38  # v id, u8 name
    NAMED_ATTRIBUTE = 39  # v id, s name, s value: data-* and aria-*
    NAMED_UNSET = 40  # v id, s name
    CLASSES = 41  # v id, s classes
    STYLE = 42  # v id, s custom property, s value (empty: unset)
    POSE = 43  # v id, f32 x, f32 y, f32 yaw
    FAR_POSE = 44  # v id, f64 x, f64 y, f32 yaw
    MATRIX = 45  # v id, 6 f64
    DOTS = 46  # v id, f32 unit, v count, count times (i16 x, i16 y)
    AGE = 47  # v id, v milliseconds of the display's clock (0: never)
    AGE_LIMIT = 48  # v id, f32 seconds, u8 whether the age is the text
    DATA = 49  # v id of a text, s text
    EVENTS = 50  # v id, u8 count, count times (u8 event, u8 flags)
    EMPTY = 51  # v id: drop the page's own content of a bound element
    MAP = 52  # v id of svg, v id of world, f32 width, f32 height (0: its container's)
    RAYS = 53  # v id, and the bytes of webmap.scene.wire.rays
    LINE = 54  # v id, v length, v count, count times (f32 x, f32 y): its last points


TABLES = {
    "OP": {op.name: op.value for op in Op},
    "FLAG": {"RESET": RESET, "PREVENT": PREVENT, "STOP": STOP},
    "PLACE": {"LAST": LAST, "FIRST": FIRST, "AFTER": AFTER},
    "VIEW_OPERATIONS": list(VIEW_OPERATIONS),
    "SVG_TAGS": list(SVG_TAGS),
    "HTML_TAGS": list(HTML_TAGS),
    "ATTRIBUTES": list(ATTRIBUTES),
    "BOOLEAN_ATTRIBUTES": sorted(BOOLEAN_ATTRIBUTES),
    "EVENTS": list(EVENTS),
}
"""All tables, as the browser gets them."""

VERSION = zlib.crc32(repr(TABLES).encode()) & 0xFFFF
"""The version of the tables; a page with another one detects the difference."""


def new_varint(number: int) -> bytes:
    """Return what :func:`varint` does, for a number that hardly ever comes again."""
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    out.append(number)
    return bytes(out)


@lru_cache(maxsize=1 << 15)
def varint(number: int) -> bytes:
    """Return ``number``, which is not negative, with seven bits in each byte."""
    return new_varint(number)


def string(text: str) -> bytes:
    """Return the length of ``text`` and its UTF-8; lone surrogates become ``?``."""
    data = text.encode("utf-8", "replace")
    return varint(len(data)) + data
