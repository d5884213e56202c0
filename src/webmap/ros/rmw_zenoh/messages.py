"""The messages of rmw_zenoh, and the type hashes that say which definition they have.

rmw_zenoh sends no definitions: the key of a topic has the name of the type and a hash
of its definition (RIHS01 of ROS 2). WebMap reads a topic if the hash is that of the
definition which is included in WebMap.
"""

import hashlib
import json
from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

from webmap.base.errors import ConfigError, ProtocolError
from webmap.base.text import one_line
from webmap.ros.definitions import Field, UnknownType, shipped
from webmap.ros.foxglove.messages import FoxgloveMessage, RawMessage, format_of
from webmap.ros.foxglove.protocol import message_data
from webmap.ros.names import split_type
from webmap.ros.received_message import ReceivedMessage
from webmap.ros.serialized.schemas import parts_of
from webmap.ros.subscriptions import Topic

NO_HASH = "TypeHashNotSupported"
"""What rmw_zenoh of ROS 2 Humble has in place of a hash."""

_STAMP = slice(8, 16)
"""Where an attachment has the time of publishing, in nanoseconds."""

_ATTACHMENT = 33
"""Bytes of an attachment: number, time, and the publisher's 16 bytes with a length."""

_NUMBERS = "int8 uint8 int16 uint16 int32 uint32 int64 uint64 float32 float64"
_IDS = {name: id for id, name in enumerate(_NUMBERS.split(), 2)}
_IDS |= {"char": _IDS["uint8"], "bool": 15, "byte": 16, "string": 17}
_NESTED, _BOUNDED_STRING = 1, 21
_OF_SIZE, _OF_LIMIT, _OF_ANY_LENGTH = 48, 96, 144
"""What is added to the number of a type for each kind of array."""

_NAMES = {"time": "builtin_interfaces/Time", "duration": "builtin_interfaces/Duration"}
_EMPTY = (Field("structure_needs_at_least_one_member", "uint8"),)


@cache
def type_hash(type: str) -> str:
    """Return the hash of the definition of a message type that is included in WebMap.

    Raises:
        ConfigError: If the definition is missing.

    """
    fields = shipped(ros2=True).definition(type).fields
    parts: dict[str, Any] = {}
    description = _described(str(split_type(type)), fields, parts)
    whole = {
        "type_description": description,
        "referenced_type_descriptions": [parts[name] for name in sorted(parts)],
    }
    return f"RIHS01_{hashlib.sha256(json.dumps(whole).encode()).hexdigest()}"


def _described(
    name: str, fields: Sequence[Field], parts: dict[str, Any]
) -> dict[str, Any]:
    found = []
    for field in fields or _EMPTY:
        inner, nested = parts_of(field, "cdr"), ""
        if inner is None:
            bounded = field.longest is not None
            id = _BOUNDED_STRING if bounded else _IDS[field.type]
        else:
            id, plain = _NESTED, _NAMES.get(field.type, field.type)
            nested = _full_name(plain)
            parts[nested] = _described(plain, inner, parts)
        if field.is_array:
            kind = _OF_LIMIT if field.most is not None else _OF_ANY_LENGTH
            id += kind if field.size is None else _OF_SIZE
        type = {
            "type_id": id,
            "capacity": field.size or field.most or 0,
            "string_capacity": field.longest or 0,
            "nested_type_name": nested,
        }
        found.append({"name": field.name, "type": type})
    return {"type_name": _full_name(name), "fields": found}


def _full_name(name: str) -> str:
    """Return a name with its kind; only parts of actions have ``_`` in their names."""
    package, _, type = name.partition("/")
    return f"{package}/{'action' if '_' in type else 'msg'}/{type}"


def refusal_of(type: str, hash: str) -> str | None:
    """Return why messages of a type cannot be read; None if they can be.

    Args:
        type: The name of the type.
        hash: The hash of the robot's definition.

    """
    if hash == NO_HASH:
        return (
            "the robot sends no hash of its types, as rmw_zenoh of ROS 2 Humble; "
            "WebMap reads rmw_zenoh of ROS 2 Kilted and later"
        )
    try:
        mine = type_hash(type)
    except UnknownType as error:
        return f"the definition of {error.type} is not included in WebMap"
    except ConfigError as error:
        return str(error)
    if mine == hash:
        return None
    return (
        f"the robot's definition of {type} is another one than WebMap's: the hash is "
        f"{one_line(hash, 100)}, expected {mine}"
    )


class Sample(NamedTuple):
    """A message as it came."""

    payload: bytes
    """The bytes of the node; empty if there are too many."""

    size: int
    attachment: bytes


def message_of(topic: Topic, type: str, sample: Sample) -> tuple[ReceivedMessage, int]:
    """Return a message, and when it was published, in nanoseconds since 1970.

    A Foxglove server sends the same bytes after a head with that time. The message gets
    this head, so that one class reads the messages of both.

    Raises:
        ProtocolError: If the sample is not one of rmw_zenoh.

    """
    attachment = sample.attachment
    if len(attachment) != _ATTACHMENT or attachment[16] != 16:
        raise ProtocolError(
            f"{topic.name}: got a message with an attachment of {len(attachment)} "
            f"bytes, expected {_ATTACHMENT} as of rmw_zenoh of ROS 2 Kilted: the "
            "sender is another program or an older rmw_zenoh"
        )
    stamp = int.from_bytes(attachment[_STAMP], "little")
    kind = RawMessage if topic.options().encoding == "raw" else FoxgloveMessage
    frame = message_data(0, stamp, sample.payload)
    message = kind(topic.name, frame, format=format_of(type, "cdr", None, None))
    message.size = sample.size
    return message, stamp
