"""Messages of the rosbridge server, made from the objects that rosbags decodes."""

import keyword
from collections.abc import Callable, Sequence
from typing import Any

from webmap.ros.definitions import OCTETS, TIMES, Field
from webmap.ros.rosbridge.server.schema import DTYPES, Schema

Make = Callable[[Any], Any]


class Messages:
    """Converts rosbags' objects to messages of the rosbridge server.

    Arrays stay arrays, and bytes become bytes; times have the field names of the
    schema's dialect.

    Args:
        schema: The types with their fields.

    """

    def __init__(self, schema: Schema) -> None:
        self._schema = schema
        self._known: dict[str, Make] = {}

    def message(self, type_name: str, value: object) -> dict[str, Any]:
        """Return the message of an object.

        Args:
            type_name: The type of the message, by its name in the schema.
            value: The object that rosbags decoded.

        Raises:
            UnknownType: If the type is not in the schema.

        """
        make = self._known.get(type_name)
        if make is None:
            # Built once for each type, since messages come many times a second.
            fields = self._schema.fields(type_name)
            make = self._known[type_name] = self._record(fields)
        made: dict[str, Any] = make(value)
        return made

    def _record(self, fields: Sequence[Field]) -> Make:
        parts = [
            (field.name, _attribute(field.name), self._field(field)) for field in fields
        ]
        return lambda value: {
            name: make(getattr(value, inner)) for name, inner, make in parts
        }

    def _field(self, field: Field) -> Make:
        if not field.is_array:
            return self._single(field)
        if field.type in OCTETS:
            return bytes
        numbers = field.type in DTYPES
        if field.type == "bool" or (numbers and field.size is not None):
            return _listed
        if numbers:
            return _same
        single = self._single(field)
        return lambda values: [single(value) for value in values]

    def _single(self, field: Field) -> Make:
        if field.fields is not None:
            return self._record(field.fields)
        if field.type in TIMES:
            whole, rest = self._schema.dialect.time(0)
            return lambda time: {whole: int(time.sec), rest: int(time.nanosec)}
        return _same


def _attribute(field: str) -> str:
    """Return rosbags' name of a field: a keyword of Python gets an underscore."""
    return f"{field}_" if keyword.iskeyword(field) else field


def _same(value: Any) -> Any:
    return value


def _listed(values: Any) -> list[Any]:
    listed: list[Any] = values.tolist()
    return listed
