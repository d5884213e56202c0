"""The definition of a message type as a link gives it: its schema, checked."""

import re
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from typing import Literal, TypeAlias

from webmap.base.errors import ConfigError
from webmap.ros.definitions import Definitions, Field, shipped, split_texts
from webmap.ros.limits import MAX_FRAME
from webmap.ros.names import split_type
from webmap.ros.serialized.idl import messages_of

SchemaEncoding: TypeAlias = Literal["ros2msg", "ros1msg", "ros2idl"]
"""The languages of schemas, by their names in MCAP and in Foxglove's protocol."""

Encoding: TypeAlias = Literal["cdr", "ros1"]
"""The serializations of messages: CDR of ROS 2, and that of ROS 1."""

MAX_FIELDS = 2_000
"""Most fields of a type, with the fields of the types in it."""

MAX_TEXT = 1 << 18
"""Most characters of the text of a schema."""

CODES = {
    **{"bool": "?", "int8": "b", "uint8": "B", "byte": "B", "char": "B"},
    **{"int16": "h", "uint16": "H", "int32": "i", "uint32": "I"},
    **{"int64": "q", "uint64": "Q", "float32": "f", "float64": "d"},
}
"""The numeric types, and their codes in :mod:`struct` and :mod:`array`."""

SIZES = {name: struct.calcsize(f"={code}") for name, code in CODES.items()}
"""Bytes of a number of each numeric type; in CDR it is aligned to as many."""

_TIMES = {
    ("ros1", "time"): (Field("secs", "uint32"), Field("nsecs", "uint32")),
    ("ros1", "duration"): (Field("secs", "int32"), Field("nsecs", "int32")),
    ("cdr", "time"): (Field("sec", "int32"), Field("nanosec", "uint32")),
    ("cdr", "duration"): (Field("sec", "int32"), Field("nanosec", "uint32")),
}

_WIDE = re.compile(r"^\s*wstring\b(?!.*=)", re.MULTILINE)


@dataclass(frozen=True, eq=False, slots=True)
class Schema:
    """The fields of a type. Two schemas are equal only if they are the same object."""

    type: str
    """The name in the form of ROS 1: ``nav_msgs/Odometry``."""

    fields: tuple[Field, ...]
    ros2: bool
    """Whether the definition is one of ROS 2."""


@lru_cache(maxsize=512)
def read_schema(type: str, encoding: SchemaEncoding, text: str | None = None) -> Schema:
    """Return the schema of a type.

    Args:
        type: The name of the type, in either dialect.
        encoding: The language of the text.
        text: The definition of the type and of all types in it, the latter each after
            a line such as ``MSG: std_msgs/Header``; None for the definition that is
            included in WebMap.

    Raises:
        ConfigError: If the text is invalid, lacks a type, or has more fields than
            :data:`MAX_FIELDS`.

    """
    name = str(split_type(type))
    if text is not None and len(text) > MAX_TEXT:
        raise ConfigError(
            f"got a schema of {type} with {len(text)} characters; the limit is "
            f"{MAX_TEXT}"
        )
    if encoding not in ("ros2msg", "ros1msg", "ros2idl"):
        raise ConfigError(
            f"got a schema of {type} in {encoding!r}; expected ros2msg, ros1msg or "
            "ros2idl"
        )
    ros2 = encoding != "ros1msg"
    if text is None:
        known = shipped(ros2)
    else:
        plain = texts_in(text, encoding, name)
        if ros2 and any(map(_WIDE.search, plain.values())):
            raise ConfigError(
                f"{name} has a field of wstring, whose bytes differ between vendors"
            )
        known = Definitions(plain, ros2=ros2, included=False)
    schema = Schema(name, known.definition(name).fields, ros2)
    serialization: Encoding = "cdr" if ros2 else "ros1"
    every = _every_field(schema.fields, serialization)
    if next(islice(every, MAX_FIELDS, None), None) is not None:
        raise ConfigError(f"{name} has more than {MAX_FIELDS} fields in all")
    if least_size(schema.fields, serialization) > MAX_FRAME:
        raise ConfigError(
            f"{name} has arrays of fixed size that are longer than any message may be, "
            f"which is {MAX_FRAME} bytes"
        )
    return schema


def texts_in(text: str, encoding: str, name: str) -> dict[str, str]:
    """Return the text of each type in a schema, as ``.msg``, by the names of the types.

    Args:
        text: The schema.
        encoding: Its language.
        name: The name of its first type.

    Raises:
        ConfigError: If the text is invalid.

    """
    if encoding == "ros2idl":
        texts = messages_of(text)
    else:
        texts = split_texts(text, name, ros2=encoding != "ros1msg")
    return {str(split_type(each)): found for each, found in texts.items()}


def _every_field(fields: Sequence[Field], encoding: Encoding) -> Iterator[Field]:
    for field in fields:
        yield field
        yield from _every_field(parts_of(field, encoding) or (), encoding)


def parts_of(field: Field, encoding: Encoding) -> tuple[Field, ...] | None:
    """Return the fields of a message type, a time or a duration; else None."""
    return _TIMES.get((encoding, field.type), field.fields)


def least_size(fields: Sequence[Field], encoding: Encoding) -> int:
    """Return the bytes of the shortest message with these fields, without padding."""
    if not fields:
        return 1 if encoding == "cdr" else 0
    return sum(_least_size(field, encoding) for field in fields)


def _least_size(field: Field, encoding: Encoding) -> int:
    if field.is_array and field.size is None:
        return 4
    parts = parts_of(field, encoding)
    size = SIZES.get(field.type, 4) if parts is None else least_size(parts, encoding)
    return size if field.size is None else size * field.size
