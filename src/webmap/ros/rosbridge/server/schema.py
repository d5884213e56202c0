"""The types of the graph behind the server, and complete messages of these types."""

import base64
import binascii
import math
import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from webmap.ros.definitions import (
    FLOATS,
    INTEGERS,
    OCTETS,
    Definition,
    Definitions,
    Field,
    UnknownType,
    shipped,
)
from webmap.ros.message_check import MessageCheck, Misfit, check_size, wrong
from webmap.ros.rosbridge.server.dialect import Dialect, canonical
from webmap.ros.serialized.schemas import CODES

DTYPES = {name: f"<{code}" for name, code in CODES.items() if name != "bool"}
"""The numeric types and their little-endian format."""


class MessageMismatch(Exception):
    """A message does not fit its type; the text names the field, as in rosbridge."""


class Schema:
    """The types of one graph, in one dialect."""

    def __init__(self, dialect: Dialect) -> None:
        self.dialect = dialect
        self._known = shipped(ros2=dialect.is_ros2)
        self._texts: dict[str, str] = {}
        self._conformer = _FromClient(dialect)
        self._finite = _FromClient(dialect, finite=True)

    def define(self, texts: Mapping[str, str]) -> None:
        """Add definitions, which replace the included ones.

        Args:
            texts: The texts of a type and of all types in it, by name.

        """
        self._texts.update(texts)
        self._known = Definitions(self._texts, ros2=self.dialect.is_ros2)

    def definition(self, type_name: str) -> Definition:
        """Return the definition of a message type, in either dialect.

        Raises:
            UnknownType: If the type is not in the graph.

        """
        name = canonical(type_name)
        if name not in self._known:
            raise UnknownType(type_name)
        return self._known.definition(name)

    def fields(self, type_name: str) -> tuple[Field, ...]:
        """Return the fields of a message type, in either dialect.

        Raises:
            UnknownType: If the type is not in the graph.

        """
        return self.definition(type_name).fields

    def text(self, type_name: str) -> str:
        """Return the text of a definition, without those of the types in it."""
        return self._known.text(canonical(type_name))

    def knows(self, type_name: str) -> bool:
        """Return whether this is a message type of the graph."""
        return canonical(type_name) in self._known

    def conform(
        self, type_name: str, value: Any, *, finite: bool = False
    ) -> dict[str, Any]:
        """Return a complete message: absent fields are zero, sequences are arrays.

        Args:
            type_name: The type, in either dialect.
            value: The values from a client; a list holds the fields in their order.
            finite: Whether to refuse NaN and infinity.

        Raises:
            MessageMismatch: If a field is unknown or of another type.
            UnknownType: If the type is unknown.

        """
        conformer = self._finite if finite else self._conformer
        try:
            return conformer.message(self.fields(type_name), value)
        except Misfit as error:
            if not error.expected:
                text = f"Message type {type_name} does not have a field {error.path}"
            else:
                place = f" for field {error.path}" if error.path else ""
                text = (
                    f"{type_name} message requires {error.expected}{place},"
                    f" but got a {type(error.value)}"
                )
            raise MessageMismatch(text) from None


class _FromClient(MessageCheck):
    """Accepts the values that rosbridge accepts from a client."""

    def __init__(self, dialect: Dialect, *, finite: bool = False) -> None:
        super().__init__(ros2=dialect.is_ros2)
        self._finite = finite

    def message(self, fields: Sequence[Field], value: Any) -> dict[str, Any]:
        if isinstance(value, list | tuple):
            value = dict(zip((field.name for field in fields), value, strict=False))
        return super().message(fields, value)

    def absent(self, field: Field, made: dict[str, Any]) -> None:
        made[field.name] = self._zero(field)

    def array(self, field: Field, value: Any) -> Any:
        if field.type in OCTETS:
            return _octets(field, value)
        items = super().array(field, value)
        if field.size is None and field.type in DTYPES:
            return np.array(items, DTYPES[field.type])
        return items

    def number(self, field: Field, value: Any) -> float:
        refused = isinstance(value, bool) and not self.ros2
        if refused or not isinstance(value, int | float):
            raise wrong(value, "a number")
        number = _as_float(value)
        if self._finite and not math.isfinite(number):
            raise wrong(value, "a finite number")
        return number

    def whole(self, field: Field, value: Any) -> int:
        if isinstance(value, bool) and self.ros2:
            value = int(value)
        return super().whole(field, value)

    def text(self, field: Field, value: Any) -> str:
        if not isinstance(value, str):
            raise wrong(value, "a text")
        return value

    def time(self, field: Field, value: Any) -> dict[str, int]:
        # rosbridge accepts the names of both dialects, and replaces the stamp "now".
        if value == "now":
            return self.spelled(*divmod(round(time.time() * 1e9), 1_000_000_000))
        if not isinstance(value, Mapping):
            raise wrong(value, "a time")
        seconds = value.get("secs", value.get("sec", 0))
        rest = value.get("nsecs", value.get("nanosec", 0))
        if not (isinstance(seconds, int) and isinstance(rest, int)):
            raise wrong(value, "whole seconds and nanoseconds")
        return self.spelled(seconds, rest)

    def _zero(self, field: Field) -> Any:
        if not field.is_array:
            return self._one_zero(field)
        if field.type in OCTETS:
            return bytes(field.size or 0)
        if field.size is not None:
            return [self._one_zero(field)] * field.size
        return np.empty(0, DTYPES[field.type]) if field.type in DTYPES else []

    def _one_zero(self, field: Field) -> Any:
        if field.fields is not None:
            return {each.name: self._zero(each) for each in field.fields}
        if field.type in INTEGERS:
            return 0
        if field.type in FLOATS:
            return 0.0
        if field.type == "string":
            return ""
        return False if field.type == "bool" else self.spelled(0, 0)


def _as_float(value: float) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _octets(field: Field, value: Any) -> bytes:
    """Return the bytes of a ``uint8[]``, which in JSON is base64 or a list."""
    if not isinstance(value, str | list):
        raise wrong(value, "base64 or a list of bytes")
    try:
        octets = (
            base64.b64decode(value, validate=True)
            if isinstance(value, str)
            else bytes(value)
        )
    except (binascii.Error, TypeError, ValueError):
        raise wrong(value, "base64 or a list of bytes") from None
    check_size(field, octets)
    return octets
