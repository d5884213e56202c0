"""The CBOR of rosbridge: only maps, text, numbers and typed arrays."""

import sys
from array import array
from collections.abc import Callable
from functools import partial
from typing import Any, NoReturn

from webmap.base.errors import ProtocolError
from webmap.base.nesting import MAX_DEPTH

# Dates, big numbers, shared references, regular expressions ...: tags that a general
# decoder decodes and that a robot has no reason to send.
_REFUSED = (0, 1, 2, 3, 4, 5, 25, 28, 29, 30, 35, 36, 37, 52, 54, 100, 256)
_REFUSED_TOO = (258, 260, 261, 1004, 43000, 55799)

# RFC 8746: tag -> type code, little-endian. Half and quadruple floats have none.
_LITTLE = {64: "B", 68: "B", 69: "H", 70: "I", 71: "Q"}
_LITTLE |= {72: "b", 77: "h", 78: "i", 79: "q", 85: "f", 86: "d"}
_BIG = {65: "H", 66: "I", 67: "Q", 73: "h", 74: "i", 75: "q", 81: "f", 82: "d"}
_CODES = _LITTLE | _BIG
TYPED_ARRAY_TAGS = frozenset(_CODES)
_FOREIGN = frozenset(_LITTLE if sys.byteorder == "big" else _BIG)
"""The tags of numbers in the other byte order than this machine's."""


def looks_like_cbor(frame: bytes | bytearray) -> bool:
    """Return whether the frame begins like a CBOR map; no JSON text does."""
    return len(frame) > 0 and 0xA0 <= frame[0] <= 0xBF


def decode(frame: bytes | bytearray) -> dict[str, Any]:
    """Return the map in ``frame``; typed arrays are ``array.array``.

    Raises:
        ProtocolError: If the bytes are not such a map.

    """
    import cbor2

    try:
        value = cbor2.loads(
            frame,
            max_depth=MAX_DEPTH,
            strict_hashable_types=True,
            semantic_decoders=_DECODERS,
            tag_hook=lambda tag, *_: _refuse(tag.tag),
        )
    except (
        cbor2.CBORError,
        ValueError,
        TypeError,
        RecursionError,
        OverflowError,
        MemoryError,  # a frame may claim any size
    ) as error:
        raise ProtocolError(f"not CBOR: {error}") from None
    if not isinstance(value, dict):
        raise ProtocolError(f"expected a map in CBOR, got {type(value).__name__}")
    return value


def typed_array(tag: int, value: object, _immutable: bool = False) -> "array[Any]":
    """Return the numbers of a CBOR typed array.

    Raises:
        ValueError: If the length is not a multiple of the size of a number.

    """
    if not isinstance(value, bytes):
        raise ValueError(f"typed array {tag} holds {type(value).__name__}, not bytes")
    numbers: array[Any] = array(_CODES[tag], value)
    if tag in _FOREIGN:
        numbers.byteswap()
    return numbers


def _refuse(tag: int, *_: Any) -> NoReturn:
    raise ValueError(f"tag {tag} has no place in a ROS message")


_DECODERS: dict[int, Callable[[Any, bool], Any]] = {
    **{tag: partial(_refuse, tag) for tag in (*_REFUSED, *_REFUSED_TOO)},
    **{tag: partial(typed_array, tag) for tag in TYPED_ARRAY_TAGS},
}
