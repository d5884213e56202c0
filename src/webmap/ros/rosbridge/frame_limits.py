"""Limits of the number of values in a frame, counted before any of them is built."""

import re

from webmap.ros.limits import GENERAL, MAX_VALUES, MIB, TooLarge

MAX_OTHER = 4 * MIB
"""Most bytes of a frame that is not plainly a message on a topic."""

MAX_NUMBERS = 200_000
"""Most values of such a frame if it has NaN and only the slow decoder can read it."""

MAX_ITEMS = 1_000_000
"""Most data items in one message in CBOR, where an array of numbers is one item."""


def check_count(frame: bytes | bytearray) -> None:
    """Check the number of values in a frame.

    Args:
        frame: A whole frame, JSON or CBOR. Any other frame passes; the decoder reports
            it.

    Raises:
        TooLarge: If there are more than :data:`MAX_VALUES` objects and lists, or more
            than :data:`MAX_ITEMS` items of CBOR.

    """
    if frame[:1] and 0xA0 <= frame[0] <= 0xBF:
        _count_cbor(frame)
    elif (
        _brackets(frame) > MAX_VALUES
        # Strings may contain brackets, too.
        and (count := _brackets(_TEXT.sub(b"", frame))) > MAX_VALUES
    ):
        raise _too_many(count, MAX_VALUES)


# Possessive: no backtracking.
_TEXT = re.compile(rb'"(?:[^"\\]++|\\.)*+"', re.DOTALL)


def _brackets(text: bytes | bytearray) -> int:
    return text.count(b"{") + text.count(b"[")


def _too_many(count: int, most: int) -> TooLarge:
    what = "objects and lists" if most == MAX_VALUES else "items of CBOR"
    return TooLarge(
        f"got a message with {count} or more {what}; the limit is {most}: "
        f"{GENERAL.advice}"
    )


def _count_cbor(frame: bytes | bytearray) -> None:
    """Walk from the head of one item to the next, as in RFC 8949, section 3."""
    at = items = values = 0
    end = len(frame)
    while at < end:
        kind, info = frame[at] >> 5, frame[at] & 31
        at += 1
        length = info
        if 24 <= info <= 27:
            size = 1 << (info - 24)
            length = int.from_bytes(frame[at : at + size], "big")
            at += size
        if kind in (2, 3) and info != 31:
            at += length
        items += 1
        values += kind in (4, 5)
        if values > MAX_VALUES:
            raise _too_many(values, MAX_VALUES)
        if items > MAX_ITEMS:
            raise _too_many(items, MAX_ITEMS)
