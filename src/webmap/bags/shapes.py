"""The fields of the types that rosbags knows, as the rosbridge server takes them."""

import keyword
from typing import TYPE_CHECKING, cast

from webmap.sim.rosbridge.dialect import canonical
from webmap.sim.rosbridge.schema import SCALARS, Field, UnknownType

if TYPE_CHECKING:
    from rosbags.interfaces.typing import FieldDesc
    from rosbags.typesys.store import Typestore

Shape = tuple[Field, ...]
"""The fields of one type, in their order on the wire."""

_BASE, _NAME, _ARRAY, _SEQUENCE = 1, 2, 3, 4
"""rosbags' kinds of fields."""

_TIMES = {
    "builtin_interfaces/msg/Time": "time",
    "builtin_interfaces/msg/Duration": "duration",
}
_SAME = {"byte": "uint8", "char": "uint8"}
_FILLER = "structure_needs_at_least_one_member"
"""What a type without fields has in ROS 2, where nobody looks."""


def shapes_of(store: "Typestore", type_name: str) -> dict[str, Shape]:
    """Return the fields of a type and of all types in it, by name.

    Names are canonical: ``nav_msgs/Odometry``.

    Args:
        store: What rosbags knows of types.
        type_name: As rosbags has it: ``nav_msgs/msg/Odometry``.

    Raises:
        UnknownType: If the store does not know the type or one in it, or a field is
            of a kind that messages over rosbridge do not have.

    """
    found: dict[str, Shape] = {}
    waiting = [type_name]
    while waiting:
        name = waiting.pop()
        if canonical(name) in found:
            continue
        if name not in store.fielddefs:
            raise UnknownType(f"there is no definition of {name}")
        fields = [
            (field, description)
            for field, description in store.fielddefs[name][1]
            if field != _FILLER
        ]
        found[canonical(name)] = tuple(
            Field(_plain(field), *_kind(name, description))
            for field, description in fields
        )
        waiting += [inner for _, each in fields if (inner := _inner(each))]
    return found


def attribute(field: str) -> str:
    """Return what rosbags calls a field: a word of Python gets a line behind it."""
    return f"{field}_" if keyword.iskeyword(field) else field


def _plain(name: str) -> str:
    short = name.removesuffix("_")
    return short if keyword.iskeyword(short) else name


def _kind(owner: str, description: "FieldDesc") -> tuple[str, int | None]:
    """Return the name of a field's type, and its length as ``Field`` has it."""
    kind = int(description[0])
    if kind in (_ARRAY, _SEQUENCE):
        part, size = _parts(description)
        return _kind(owner, part)[0], size if kind == _ARRAY else -1
    if kind == _NAME:
        name = str(description[1])
        return _TIMES.get(name) or canonical(name), None
    name = str(description[1][0])
    name = _SAME.get(name, name)
    if name not in SCALARS:
        raise UnknownType(f"{owner} has a field of the type {name}")
    return name, None


def _inner(description: "FieldDesc") -> str:
    """Return the type in a field whose fields are to be known too, if there is one."""
    if int(description[0]) in (_ARRAY, _SEQUENCE):
        return _inner(_parts(description)[0])
    name = str(description[1]) if int(description[0]) == _NAME else ""
    return "" if name in _TIMES else name


def _parts(description: "FieldDesc") -> "tuple[FieldDesc, int]":
    part, size = cast("tuple[FieldDesc, int]", description[1])
    return part, size
