"""Makes functions that read serialized messages; the code of each is compiled."""

import struct
import sys
from array import array
from collections.abc import Callable
from functools import lru_cache, partial
from itertools import repeat
from typing import Any, TypeAlias

import msgspec

from webmap.base.errors import ProtocolError
from webmap.ros.arrays import NOT_COPIED, Numbers
from webmap.ros.decoding import convert
from webmap.ros.limits import GENERAL, MAX_VALUES, TooLarge
from webmap.ros.serialized.program import Program
from webmap.ros.serialized.rows import Misguess, Texts, text_of
from webmap.ros.serialized.schemas import Encoding, Schema

Reader: TypeAlias = Callable[[bytes | bytearray | memoryview], Any]

_NATIVE_IS_BIG = sys.byteorder == "big"
_KINDS = dict.fromkeys((2, 3), "PL_CDR") | dict.fromkeys(range(6, 12), "XCDR2")


@lru_cache(maxsize=512)
def make_reader(
    schema: Schema, wanted: type[msgspec.Struct] | None, encoding: Encoding
) -> Reader:
    """Return a function that reads messages of a type.

    Args:
        schema: The definition of the type.
        wanted: A view of the type; the reader skips the fields that it has not. None
            for a dict with all fields, where arrays of numbers are ``array.array`` and
            ``uint8[]`` is ``bytes``, as a link to a rosbridge has them.
        encoding: The serialization of the messages.

    Returns:
        The reader. It raises ProtocolError if the bytes do not fit the schema, and
        TooLarge if the message has more than
        :data:`~webmap.ros.limits.MAX_VALUES` values. Long arrays share the memory of
        the bytes, which must not change later.

    Raises:
        ProtocolError: If the schema has not the fields of ``wanted``.

    """

    def other(data: bytes | bytearray | memoryview) -> Any:
        """Read what the function for usual messages does not."""
        big = encoding == "cdr" and _is_big(schema, data)
        if big not in unusual:
            program = Program(schema, wanted, encoding, big=big)
            unusual[big] = _compiled(schema, program, encoding, other, big=big)
        return unusual[big](data)

    unusual: dict[bool, Reader] = {}
    program = Program(schema, wanted, encoding, usual=True)
    return _compiled(schema, program, encoding, other)


def _is_big(schema: Schema, data: bytes | bytearray | memoryview) -> bool:
    """Return whether CDR is big-endian."""
    head = bytes(data[:4])
    if len(head) < 4:
        raise ProtocolError(
            f"got a {schema.type} of {len(head)} bytes; CDR begins with 4 bytes"
        )
    if head[0] or head[1] > 1:
        kind = _KINDS.get(head[1], "unknown") if not head[0] else "unknown"
        raise ProtocolError(
            f"got a {schema.type} that begins with {head[:2].hex(' ')} ({kind}); "
            "expected CDR, which begins with 00 00 or 00 01"
        )
    return not head[1]


def _compiled(
    schema: Schema,
    program: Program,
    encoding: Encoding,
    other: Reader,
    *,
    big: bool = False,
) -> Reader:
    """Return the function of a program."""
    foreign, ends = big != _NATIVE_IS_BIG, encoding == "cdr"

    def numbers(code: str, data: bytes | memoryview) -> "array[Any]":
        found: array[Any] = array(code, bytes(data))
        if foreign:
            found.byteswap()
        return found

    def packed(type: type[Numbers], code: str, data: bytes | memoryview) -> Numbers:
        if code != type.typecode or (foreign and array(code).itemsize > 1):
            return type.from_wire(numbers(code, data))
        if len(data) <= NOT_COPIED:
            return type(array(code, bytes(data)))
        return type(memoryview(data).cast(code))  # type: ignore[call-overload]

    def short() -> ProtocolError:
        return ProtocolError(
            f"got a {schema.type} that ends before its last field; its bytes do not "
            "fit its schema"
        )

    def long(count: int) -> ProtocolError:
        return ProtocolError(
            f"got a {schema.type} with {count} bytes after its last field; its bytes "
            "do not fit its schema"
        )

    def many() -> TooLarge:
        return TooLarge(
            f"got a message with more than {MAX_VALUES} values; the limit is "
            f"{MAX_VALUES}: {GENERAL.advice}"
        )

    def unfit(error: Exception) -> ProtocolError:
        if isinstance(error, struct.error | IndexError):
            return short()
        return ProtocolError(f"got a {schema.type} that cannot be read: {error}")

    names: dict[str, Any] = {
        **program.names,
        "array": array,
        "convert": convert,
        "text": partial(text_of, ends=ends),
        "texts": Texts(big=big, ends=ends),
        "Misguess": Misguess,
        "long": long,
        "many": many,
        "numbers": numbers,
        "repeat": repeat,
        "other": other,
        "packed": packed,
        "short": short,
        "unfit": unfit,
        "StructError": struct.error,
    }
    # The text consists of numbers, of names made here, and of quoted names of fields.
    exec(compile(program.text, f"<{schema.type}>", "exec"), names)  # noqa: S102
    reader: Reader = names["read"]
    return reader
