"""From what rosbags reads to the messages that go over rosbridge."""

from collections.abc import Callable
from typing import Any

from webmap.bags.shapes import attribute
from webmap.sim.rosbridge.schema import DTYPES, TIMES, Field, Schema

Make = Callable[[Any], Any]


class Messages:
    """Makes messages, as the rosbridge server publishes them, of rosbags' objects.

    Arrays stay arrays, and bytes become bytes; times are spelled as the dialect of the
    schema has them.

    Args:
        schema: Knows the fields of the types.

    """

    def __init__(self, schema: Schema) -> None:
        self._schema = schema
        self._known: dict[str, Make] = {}

    def message(self, type_name: str, value: object) -> dict[str, Any]:
        """Return the message of an object.

        Args:
            type_name: Of the message, as the schema knows it.
            value: What rosbags made of its bytes.

        Raises:
            UnknownType: If the schema does not know the type.

        """
        made: dict[str, Any] = self._of(type_name)(value)
        return made

    def _of(self, type_name: str) -> Make:
        make = self._known.get(type_name)
        if make is None:
            make = self._known[type_name] = self._record(type_name)
        return make

    def _record(self, type_name: str) -> Make:
        # Worked out once a type, for messages of it come many times a second.
        parts = [
            (field.name, attribute(field.name), self._field(field))
            for field in self._schema.fields(type_name)
        ]
        return lambda value: {
            name: make(getattr(value, inner)) for name, inner, make in parts
        }

    def _field(self, field: Field) -> Make:
        if field.length is None:
            return self._single(field.type)
        if field.type == "uint8":
            return bytes
        if field.type == "bool" or (field.type in DTYPES and field.length >= 0):
            return _listed
        if field.type in DTYPES:
            return _same
        single = self._single(field.type)
        return lambda values: [single(value) for value in values]

    def _single(self, type_name: str) -> Make:
        if type_name in TIMES:
            whole, rest = self._schema.dialect.time(0)
            return lambda time: {whole: int(time.sec), rest: int(time.nanosec)}
        if type_name in DTYPES or type_name in ("string", "bool"):
            return _same
        return self._of(type_name)


def _same(value: Any) -> Any:
    return value


def _listed(values: Any) -> list[Any]:
    listed: list[Any] = values.tolist()
    return listed
