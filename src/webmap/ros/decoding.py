"""Decoding of bytes to a value of a given type: strictly, then leniently.

Nearly every frame passes the strict decoding, in one step of msgspec. The lenient
decoding accepts what real bridges write outside of the standard: the bare tokens
``NaN`` and ``Infinity``, ``null`` instead of a number, and a single surrogate in a
string, which Python writes for a byte that is not UTF-8. Such a surrogate becomes
U+FFFD.
"""

import json
import math
import re
from array import array
from functools import lru_cache
from typing import Any

import msgspec

from webmap.base.errors import ProtocolError
from webmap.base.nesting import MAX_DEPTH, is_too_deep
from webmap.ros.arrays import dec_hook

_HALF_PAIRS = re.compile("[\ud800-\udfff]")
_HALF_PAIR_ESCAPE = re.compile(rb"\\u[dD][89a-fA-F]")
_REPLACEMENT = "\N{REPLACEMENT CHARACTER}"

_FAILURES = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)


class Unreadable(ProtocolError):
    """The frame is not JSON, whatever type was expected."""


@lru_cache(maxsize=256)
def _decoder(type: Any) -> "msgspec.json.Decoder[Any]":
    return msgspec.json.Decoder(type, dec_hook=dec_hook)


def decode_json(text: bytes | bytearray, type: Any) -> Any:
    """Return the JSON in ``text`` as a value of ``type``.

    Raises:
        ProtocolError: If the text is not JSON, not even leniently, or has another
            shape.

    """
    try:
        return _decoder(type).decode(text)
    except msgspec.ValidationError as error:
        reason: Exception = error
    except _FAILURES as error:
        # The lenient decoding accepts only these tokens and such escapes.
        numbers = b"NaN" in text or b"Infinity" in text
        if not numbers and not _HALF_PAIR_ESCAPE.search(text):
            raise Unreadable(f"not JSON: {error}") from None
        reason = error
    try:
        value = json.loads(text.decode())
        if _HALF_PAIR_ESCAPE.search(text):
            value = _whole_text(value, MAX_DEPTH)
    except (ValueError, RecursionError):
        raise Unreadable(f"not JSON: {reason}") from None
    return convert(value, type)


def _whole_text(value: Any, allowed: int) -> Any:
    """Return ``value`` with each single surrogate in a string replaced by U+FFFD."""
    if allowed == 0:
        raise ProtocolError(f"a message nested deeper than {MAX_DEPTH} levels")
    if isinstance(value, str):
        return _HALF_PAIRS.sub(_REPLACEMENT, value)
    if isinstance(value, dict):
        return {
            _HALF_PAIRS.sub(_REPLACEMENT, key): _whole_text(item, allowed - 1)
            for key, item in value.items()
        }
    if isinstance(value, list):
        return [_whole_text(item, allowed - 1) for item in value]
    return value


def convert(value: Any, type: Any) -> Any:
    """Return a decoded value as a value of ``type``.

    ``null`` becomes NaN where a number is expected, and a typed array becomes a list
    where a list is expected.

    Raises:
        ProtocolError: If the value has another shape.

    """
    try:
        return msgspec.convert(value, type, dec_hook=dec_hook)
    except (msgspec.ValidationError, RecursionError) as error:
        reason = error
    try:
        plain = _plain(value, MAX_DEPTH)
        return msgspec.convert(plain, type, dec_hook=dec_hook)
    except (msgspec.ValidationError, RecursionError):
        raise ProtocolError(str(reason)) from None


def check_depth(value: Any) -> None:
    """Check that a plain value is not nested too deeply.

    Raises:
        ProtocolError: If the value is nested too deeply.

    """
    if is_too_deep(value):
        raise ProtocolError(f"a message nested deeper than {MAX_DEPTH} levels")


def _plain(value: Any, allowed: int) -> Any:
    """Return ``value`` with NaN for null and lists for typed arrays."""
    if allowed == 0:
        raise ProtocolError(f"a message nested deeper than {MAX_DEPTH} levels")
    if value is None:
        return math.nan
    if isinstance(value, array):
        return value.tolist()
    if isinstance(value, dict):
        return {key: _plain(item, allowed - 1) for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item, allowed - 1) for item in value]
    return value
