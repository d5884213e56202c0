"""Writes serialized messages: CDR of ROS 2, and the serialization of ROS 1."""

import struct
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

from webmap.ros.definitions import OCTETS, TIMES, Field
from webmap.ros.message_check import Misfit, check_names, check_size, wrong
from webmap.ros.serialized.schemas import CODES, SIZES, Encoding, Schema, parts_of

Writer: TypeAlias = Callable[[Mapping[str, Any]], bytes]

_HEAD = b"\0\1\0\0"
_NUMBERS = {name: struct.Struct(f"<{code}") for name, code in CODES.items()}


def make_writer(schema: Schema, encoding: Encoding) -> Writer:
    """Return a function that writes messages of a type, little-endian.

    Args:
        schema: The definition of the type.
        encoding: The serialization.

    Returns:
        The writer. It takes the values of fields by their names, and fills absent ones
        with their defaults: zero, false or empty, if the definition has none. A time
        may have the names of either dialect. It raises Misfit, a ConfigError, for a
        value that does not fit its field.

    """

    def write(message: Mapping[str, Any]) -> bytes:
        return serialize(schema.fields, message, ros2=encoding == "cdr")

    return write


def serialize(
    fields: Sequence[Field], message: Mapping[str, Any], *, ros2: bool
) -> bytes:
    """Return the serialized bytes of a message.

    Args:
        fields: The fields of its type.
        message: The values; arrays of numbers are lists, arrays or bytes.
        ros2: Whether to serialize as CDR, as in ROS 2; else as in ROS 1.

    Raises:
        Misfit: If a value does not fit its field.

    """
    writer = _Writer("cdr" if ros2 else "ros1")
    writer.message(fields, message)
    body = bytes(writer.out)
    return _HEAD + body if ros2 else body


class _Writer:
    def __init__(self, encoding: Encoding) -> None:
        self.encoding = encoding
        self.cdr = encoding == "cdr"
        self.out = bytearray()

    def message(self, fields: Sequence[Field], message: Mapping[str, Any]) -> None:
        if not isinstance(message, Mapping):
            raise wrong(message, "a table of fields")
        if self.cdr and not fields:
            self.out.append(0)  # CDR has no empty structure
        found = 0
        for field in fields:
            value = message.get(field.name)
            found += field.name in message
            try:
                if field.is_array:
                    self._array(field, () if value is None else value)
                else:
                    self._one(field, field.default if value is None else value)
            except Misfit as error:
                raise error.inside(field.name) from None
        if found < len(message):
            check_names(fields, message)

    def _array(self, field: Field, values: Any) -> None:
        """Write an array; one of fixed size that is absent gets its default items."""
        if field.size is not None and not len(values):
            values = [None] * field.size
        check_size(field, values)
        if field.size is None:
            self._number("uint32", len(values))
        if isinstance(values, bytes) and field.type in OCTETS:
            self.out += values
        elif field.type in CODES and len(values):
            self._align(SIZES[field.type])
            self.out += _packed(field.type, values)
        else:
            for index, each in enumerate(values):
                try:
                    self._one(field, each)
                except Misfit as error:
                    raise error.inside(f"[{index}]") from None

    def _one(self, field: Field, value: Any) -> None:
        parts = parts_of(field, self.encoding)
        if field.type in TIMES:
            assert parts is not None
            self.message(parts, _time(value, parts))
        elif parts is not None:
            self.message(parts, {} if value is None else value)
        elif field.type == "string":
            self._text("" if value is None else value)
        else:
            self._number(field.type, 0 if value is None else value)

    def _text(self, value: Any) -> None:
        if not isinstance(value, str):
            raise wrong(value, "a text")
        try:
            octets = value.encode() + b"\0" * self.cdr
        except UnicodeEncodeError:
            raise wrong(value, "a text that UTF-8 can hold") from None
        self._number("uint32", len(octets))
        self.out += octets

    def _number(self, type: str, value: Any) -> None:
        self._align(SIZES[type])
        try:
            self.out += _NUMBERS[type].pack(value)
        except (struct.error, OverflowError):
            raise wrong(value, f"a value of {type}") from None

    def _align(self, size: int) -> None:
        if self.cdr:
            self.out += bytes(-len(self.out) % size)


def _packed(type: str, values: Any) -> bytes:
    """Return the bytes of numbers, little-endian."""
    try:
        view = memoryview(values)
    except TypeError:
        view = None
    if view is not None and view.format == CODES[type] and sys.byteorder == "little":
        return view.tobytes()
    items = [0 if each is None else each for each in values]
    try:
        return struct.pack(f"<{len(items)}{CODES[type]}", *items)
    except (struct.error, OverflowError) as error:
        raise Misfit(f"{error}; expected values of {type}", value=values) from None


def _time(value: Any, parts: Sequence[Field]) -> dict[str, Any]:
    """Return a time under the names of a dialect."""
    value = {} if value is None else value
    if not isinstance(value, Mapping):
        raise wrong(value, "a time with seconds and nanoseconds")
    whole, rest = parts
    return {
        whole.name: value.get("secs", value.get("sec", 0)),
        rest.name: value.get("nsecs", value.get("nanosec", 0)),
    }
