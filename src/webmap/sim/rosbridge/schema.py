"""The fields of message types, and messages made to fit them."""

import base64
import binascii
import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from webmap.sim.rosbridge.definitions import MESSAGES, SERVICES
from webmap.sim.rosbridge.dialect import Dialect, canonical

DTYPES: dict[str, str] = {
    "int8": "<i1",
    "uint8": "<u1",
    "int16": "<i2",
    "uint16": "<u2",
    "int32": "<i4",
    "uint32": "<u4",
    "int64": "<i8",
    "uint64": "<u8",
    "float32": "<f4",
    "float64": "<f8",
}
"""The numeric types and their little-endian form."""

TIMES = ("time", "duration")
SCALARS = (*DTYPES, *TIMES, "string", "bool")


class MessageMismatch(Exception):
    """A message does not fit its type; the text says where."""


class UnknownType(Exception):
    """The graph has no definition of a type."""


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message type."""

    name: str
    type: str
    """Canonical, without the brackets of an array."""
    length: int | None
    """None for a single value, -1 for a sequence, else of a fixed array."""


def parse_fields(text: str) -> tuple[Field, ...]:
    """Return the fields of a definition such as ``float64[36] covariance``."""
    return tuple(
        _parse_field(*part.split()) for part in text.split(";") if part.strip()
    )


def _parse_field(type_name: str, name: str) -> Field:
    base, bracket, size = type_name.rstrip("]").partition("[")
    length = None if not bracket else int(size) if size else -1
    return Field(name, base, length)


class Schema:
    """The types of one graph, in one dialect."""

    def __init__(self, dialect: Dialect) -> None:
        self.dialect = dialect
        self._fields = {name: parse_fields(text) for name, text in MESSAGES.items()}
        for name, (request, response) in SERVICES.items():
            self._fields[f"{name}Request"] = parse_fields(request)
            self._fields[f"{name}Response"] = parse_fields(response)
        if dialect.is_ros2:
            header = self._fields["std_msgs/Header"]
            self._fields["std_msgs/Header"] = header[1:]
        self._messages = set(MESSAGES)

    def define(self, type_name: str, shapes: Mapping[str, tuple[Field, ...]]) -> None:
        """Take the fields of a message type from elsewhere.

        Args:
            type_name: The type, in either spelling.
            shapes: Its fields and those of all types in it, by canonical names.

        """
        self._fields.update(shapes)
        self._messages.add(canonical(type_name))

    def fields(self, type_name: str) -> tuple[Field, ...]:
        """Return the fields of a message type, in either spelling.

        Raises:
            UnknownType: If the graph does not know it.

        """
        try:
            return self._fields[canonical(type_name)]
        except KeyError:
            raise UnknownType(
                f"no definition of {type_name}; known are {sorted(MESSAGES)}"
            ) from None

    def knows(self, type_name: str) -> bool:
        """Whether this is a message type of the graph."""
        return canonical(type_name) in self._messages

    def conform(
        self, type_name: str, value: Any, *, finite: bool = False
    ) -> dict[str, Any]:
        """Return a whole message: absent fields are zero, sequences are arrays.

        Args:
            type_name: Of the message, in either spelling.
            value: What a client sent; a list gives the fields in their order.
            finite: Refuse NaN and infinity.

        Raises:
            MessageMismatch: If a field is unknown or of another type.
            UnknownType: If the type is.

        """
        fields = self.fields(type_name)
        if isinstance(value, list | tuple):
            value = dict(zip((field.name for field in fields), value, strict=False))
        if not isinstance(value, Mapping):
            raise MessageMismatch(f"{type_name} needs an object, got {value!r}")
        extra = set(value) - {field.name for field in fields}
        if extra:
            raise MessageMismatch(
                f"Message type {type_name} does not have a field {min(extra)}"
            )
        return {
            field.name: self._value(type_name, field, value[field.name], finite)
            if field.name in value
            else self._zero(field)
            for field in fields
        }

    def _zero(self, field: Field) -> Any:
        if field.length is None:
            return self._scalar_zero(field.type)
        if field.type == "uint8":
            return bytes(max(field.length, 0))
        if field.length >= 0:
            return [self._scalar_zero(field.type)] * field.length
        return np.empty(0, DTYPES[field.type]) if field.type in DTYPES else []

    def _scalar_zero(self, type_name: str) -> Any:
        if type_name in TIMES:
            return self.dialect.time(0)
        if type_name == "string":
            return ""
        if type_name == "bool":
            return False
        if type_name in DTYPES:
            return 0.0 if type_name.startswith("float") else 0
        return self.conform(type_name, {})

    def _value(self, owner: str, field: Field, value: Any, finite: bool) -> Any:
        if field.length is None:
            return self._scalar(owner, field, value, finite)
        if field.type == "uint8":
            return _octets(owner, field, value)
        if not isinstance(value, list):
            raise _mismatch(owner, field, "a list", value)
        if field.length >= 0 and len(value) != field.length:
            raise _mismatch(owner, field, f"{field.length} values", value)
        items = [self._scalar(owner, field, item, finite) for item in value]
        if field.length < 0 and field.type in DTYPES:
            return np.array(items, DTYPES[field.type])
        return items

    def _scalar(self, owner: str, field: Field, value: Any, finite: bool) -> Any:
        if field.type in DTYPES:
            return self._number(owner, field, value, finite)
        if field.type == "string":
            if not isinstance(value, str):
                raise _mismatch(owner, field, "a string", value)
            return value
        if field.type == "bool":
            if not isinstance(value, bool):
                raise _mismatch(owner, field, "a bool", value)
            return value
        if field.type in TIMES:
            return self._time(owner, field, value)
        return self.conform(field.type, value, finite=finite)

    def _number(self, owner: str, field: Field, value: Any, finite: bool) -> Any:
        if isinstance(value, bool) and not self.dialect.is_ros2:
            raise _mismatch(owner, field, "a number", value)
        if field.type.startswith("float"):
            if not isinstance(value, int | float):
                raise _mismatch(owner, field, "a number", value)
            number = _as_float(value)
            if finite and not math.isfinite(number):
                raise _mismatch(owner, field, "a finite number", value)
            return number
        if not isinstance(value, int):
            raise _mismatch(owner, field, "an integer", value)
        limits = np.iinfo(DTYPES[field.type])
        if not limits.min <= value <= limits.max:
            raise _mismatch(owner, field, f"an {field.type}", value)
        return int(value)

    def _time(self, owner: str, field: Field, value: Any) -> dict[str, int]:
        # rosbridge takes the names of both dialects, and fills the stamp "now" in.
        if value == "now":
            return self.dialect.time(time.time())
        if not isinstance(value, Mapping):
            raise _mismatch(owner, field, "a time", value)
        seconds = value.get("secs", value.get("sec", 0))
        rest = value.get("nsecs", value.get("nanosec", 0))
        if not (isinstance(seconds, int) and isinstance(rest, int)):
            raise _mismatch(owner, field, "whole seconds and nanoseconds", value)
        zero = self.dialect.time(0)
        return dict(zip(zero, (seconds, rest), strict=True))


def _as_float(value: float) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _octets(owner: str, field: Field, value: Any) -> bytes:
    """Return the bytes of a ``uint8[]``, which JSON carries as base64 or a list."""
    try:
        octets = (
            base64.b64decode(value, validate=True)
            if isinstance(value, str)
            else bytes(value)
        )
    except (binascii.Error, TypeError, ValueError):
        raise _mismatch(owner, field, "base64 or a list of bytes", value) from None
    if field.length is not None and field.length >= 0 and len(octets) != field.length:
        raise _mismatch(owner, field, f"{field.length} bytes", value)
    return octets


def _mismatch(owner: str, field: Field, expected: str, value: Any) -> MessageMismatch:
    return MessageMismatch(
        f"{owner} message requires {expected} for field {field.name},"
        f" but got a {type(value)}"
    )
