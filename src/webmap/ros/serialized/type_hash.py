"""The type hashes of ROS 2 (RIHS01), which state the definition of a type."""

import hashlib
import json
from collections.abc import Sequence
from functools import cache
from typing import Any

from webmap.base.errors import ConfigError
from webmap.base.text import one_line
from webmap.ros.definitions import Field, UnknownType, shipped
from webmap.ros.names import split_type
from webmap.ros.serialized.schemas import parts_of

NO_HASH = "TypeHashNotSupported"
"""What rmw_zenoh of ROS 2 Humble has in place of a hash."""

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
        inner, nested, id = parts_of(field, "cdr"), "", _IDS.get(field.type, _NESTED)
        if inner is not None:
            plain = _NAMES.get(field.type, field.type)
            nested = _full_name(plain)
            parts[nested] = _described(plain, inner, parts)
        elif field.longest is not None:
            id = _BOUNDED_STRING
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


def check_hash(type: str, hash: str) -> None:
    """Check that a robot has the definition of a type that is included in WebMap.

    Args:
        type: The name of the type.
        hash: The hash of the robot's definition.

    Raises:
        ConfigError: If its definition is another one, or WebMap has none.

    """
    if hash == NO_HASH:
        raise ConfigError(
            "the robot sends no hashes of its types, like rmw_zenoh of ROS 2 Humble; "
            "WebMap reads rmw_zenoh of ROS 2 Kilted and later"
        )
    try:
        mine = type_hash(type)
    except UnknownType as error:
        raise ConfigError(
            f"the definition of {error.type} is not included in WebMap"
        ) from None
    if mine != hash:
        raise ConfigError(
            f"the robot's definition of {type} differs from WebMap's: the hash is "
            f"{one_line(hash, 100)}, expected {mine}"
        )
