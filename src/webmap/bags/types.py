"""The message types of rosbags, and the writing of messages."""

import base64
import binascii
import math
from array import array
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

import msgspec
import numpy as np

from webmap.base.errors import ConfigError
from webmap.ros.definitions import (
    FLOATS,
    INTEGERS,
    OCTETS,
    SCALARS,
    Definitions,
    Field,
    UnknownType,
    shipped,
)
from webmap.ros.message_check import MessageCheck, Misfit, check_size, wrong
from webmap.ros.names import ros2_type
from webmap.ros.rosbridge.server.dialect import DialectName, canonical
from webmap.ros.rosbridge.server.schema import DTYPES
from webmap.ros.serialized.schemas import Schema
from webmap.ros.serialized.writer import serialize

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

ROS1 = ("ROS1_NOETIC",)
ROS2 = ("ROS2_KILTED", "ROS2_JAZZY", "ROS2_IRON", "ROS2_HUMBLE", "ROS2_FOXY")
"""Releases with known types, in the order in which they are tried."""

_ARRAY, _SEQUENCE = 3, 4
"""rosbags' kinds of fields that are arrays."""

_TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_FILLER = "structure_needs_at_least_one_member"
"""The only field in ROS 2 of a type without fields."""


def texts_of(store: "Typestore", type_name: str) -> dict[str, str]:
    """Return the definitions of a type and of all types in it, as texts by name.

    Args:
        store: The types of rosbags.
        type_name: The name in rosbags: ``nav_msgs/msg/Odometry``.

    Raises:
        UnknownType: If the store lacks the type or one in it, or a field is of a kind
            that messages over rosbridge do not have.

    """
    found: dict[str, str] = {}
    waiting = [type_name]
    while waiting:
        name = waiting.pop()
        if canonical(name) in found:
            continue
        if name not in store.fielddefs:
            raise UnknownType(name)
        lines = []
        for field, (kind, inner) in store.fielddefs[name][1]:
            count = ""
            if int(kind) in (_ARRAY, _SEQUENCE):
                (_, inner), size = cast("Any", inner)
                most = f"[<={size}]" if size else "[]"
                count = f"[{size}]" if int(kind) == _ARRAY else most
            if isinstance(inner, str):
                part = canonical(inner)
                waiting += [inner] if inner not in _TIMES else []
            else:
                scalar, longest = cast("Any", inner)
                if scalar not in SCALARS:
                    raise UnknownType(scalar)
                part = f"{scalar}<={longest}" if longest else scalar
            if field != _FILLER:
                lines.append(f"{part}{count} {field}")
        found[canonical(name)] = "\n".join(lines)
    return found


class TypeVersion:
    """A message type in one release of ROS, with the serialization of its messages.

    Args:
        store: The types of that release in rosbags.
        type_name: The name in rosbags: ``nav_msgs/msg/Odometry``.
        dialect: The dialect of the bytes.

    Raises:
        ConfigError: If the release has no such type, or the type is invalid.

    """

    def __init__(
        self, store: "Typestore", type_name: str, dialect: DialectName
    ) -> None:
        self.store = store
        self.type_name = type_name
        self._ros2 = dialect == "ros2"
        known = Definitions(texts_of(store, type_name), ros2=self._ros2)
        self._fields = known.definition(canonical(type_name)).fields
        self._conformer = _FromRobot(ros2=self._ros2)

    def bytes_of(self, message: object) -> bytes:
        """Return the serialized bytes of a message, as ROS sends them.

        Raises:
            Misfit: If the message does not fit the type in this release.

        """
        whole = self._conformer.message(self._fields, message)
        return serialize(self._fields, whole, ros2=self._ros2)

    def has(self, schema: Schema) -> bool:
        """Return whether serialized messages of a schema are those of this release."""
        return schema.ros2 == self._ros2 and _same_bytes(schema.fields, self._fields)


def _same_bytes(one: Sequence[Field], other: Sequence[Field]) -> bool:
    """Return whether fields have the same names and the same bytes."""
    return len(one) == len(other) and all(
        a.name == b.name
        and (a.type == b.type or {a.type, b.type} <= set(OCTETS))
        and (a.is_array, a.size) == (b.is_array, b.size)
        and _same_bytes(a.fields or (), b.fields or ())
        for a, b in zip(one, other, strict=True)
    )


def bytes_of_json(fields: Sequence[Field], text: bytes, *, ros2: bool) -> bytes:
    """Return the serialized bytes of a message in JSON.

    Args:
        fields: The fields of its type.
        text: The JSON.
        ros2: Whether to serialize as in ROS 2; else as in ROS 1.

    Raises:
        Misfit: If the message does not fit the type.
        DecodeError: If the text is no JSON.

    """
    message = _FromRobot(ros2=ros2).message(fields, msgspec.json.decode(text))
    return serialize(fields, message, ros2=ros2)


class Types:
    """The types of one ROS, in all its releases.

    Args:
        dialect: ROS 1 or ROS 2.

    """

    def __init__(self, dialect: DialectName) -> None:
        self.dialect: DialectName = dialect
        self._shipped = shipped(ros2=dialect == "ros2")
        self._stores: dict[str, Typestore] = {}

    def versions(self, type_name: str) -> Iterator[TypeVersion]:
        """Yield a message type in each release, the newest first.

        Yields nothing for a type that is unknown to both rosbags and WebMap.

        Args:
            type_name: The type, in either dialect.

        """
        try:
            name = ros2_type(type_name)
        except ConfigError:
            return
        if "/action/" in type_name:
            name = name.replace("/msg/", "/action/")
        for release in ROS1 if self.dialect == "ros1" else ROS2:
            try:
                yield TypeVersion(self._store(release), name, self.dialect)
            except ConfigError:
                continue

    def _store(self, release: str) -> "Typestore":
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        if release not in self._stores:
            store = get_typestore(Stores[release])
            for name in self._shipped:
                spelled = ros2_type(name)
                if name.endswith("_FeedbackMessage"):
                    spelled = spelled.replace("/msg/", "/action/")
                if spelled not in store.fielddefs:
                    text = self._shipped.text(name)
                    store.register(get_types_from_msg(text, spelled))
            self._stores[release] = store
        return self._stores[release]


class _FromRobot(MessageCheck):
    """Accepts complete messages, in every encoding of a rosbridge.

    In JSON ``null`` means a float that is not finite; it becomes NaN. Bytes come as
    bytes, as a list, or as text in base64.
    """

    def absent(self, field: Field, made: dict[str, Any]) -> None:
        raise Misfit("it is missing")

    def array(self, field: Field, value: Any) -> Any:
        if field.type not in DTYPES and field.type != "bool":
            return super().array(field, value)
        octets = isinstance(value, str | bytes)
        if octets:
            value = np.frombuffer(_octets(value), np.uint8)
        elif not isinstance(value, list | array | np.ndarray):
            raise wrong(value, "numbers")
        check_size(field, value)
        dtype = np.dtype(DTYPES.get(field.type, "?"))
        try:
            with np.errstate(invalid="ignore"):
                numbers = np.ascontiguousarray(value, dtype)  # None becomes NaN
        except (TypeError, ValueError, OverflowError) as error:
            raise Misfit(str(error)) from None
        if dtype.kind in "iu" and not octets:
            same = value == numbers.tolist() if isinstance(value, list) else None
            if not (np.array_equal(value, numbers) if same is None else same):
                raise wrong(value, f"whole numbers of the kind {field.type}")
        return numbers.reshape(-1)

    def number(self, field: Field, value: Any) -> float:
        if value is None:
            return math.nan
        if not isinstance(value, int | float):
            raise wrong(value, "a number")
        if FLOATS[field.type] < abs(value) < math.inf:
            raise wrong(value, f"a number that a {field.type} can hold")
        return float(value)

    def whole(self, field: Field, value: Any) -> int:
        if isinstance(value, str | bytes):  # in ROS 2 a one-byte number may come so
            one = isinstance(value, str) and len(value) == 1
            octets = b"" if one else _octets(value)
            value = ord(value) if one else int.from_bytes(octets, "little")
        low, high = INTEGERS[field.type]
        fits = isinstance(value, int | float) and math.isfinite(value)
        if not fits or int(value) != value or not low <= value <= high:
            raise wrong(value, f"a whole number from {low} to {high}")
        return int(value)

    def text(self, field: Field, value: Any) -> str:
        if not isinstance(value, str):
            raise wrong(value, "a text")
        return value

    def truth(self, value: Any) -> bool:
        if not isinstance(value, bool | int):
            raise wrong(value, "true or false")
        return bool(value)

    def time(self, field: Field, value: Any) -> dict[str, int]:
        if not isinstance(value, Mapping):
            raise wrong(value, "a time")
        whole = value.get("sec", value.get("secs"))
        rest = value.get("nanosec", value.get("nsecs"))
        if not (isinstance(whole, int) and isinstance(rest, int)):
            raise wrong(value, "seconds and nanoseconds")
        return self.spelled(whole, rest)


def _octets(value: str | bytes) -> bytes:
    if isinstance(value, bytes):
        return value
    try:
        return base64.b64decode(value, validate=True)
    except binascii.Error as error:
        raise Misfit(f"no base64: {error}") from None
