"""The stamps in messages, moved to the time at which a recording is played."""

from collections.abc import Callable
from typing import Any

from webmap.sim.rosbridge.schema import TIMES, Field, Schema

SECOND = 1_000_000_000

STAMP = "stamp"
"""What a field is called that says of when a message, or a part of it, is."""

Move = Callable[[int], int]
"""From nanoseconds since 1970 to nanoseconds since 1970."""


class Stamps:
    """Finds the stamps in messages: every time field called so, however deep.

    Args:
        schema: Knows the fields of the types, and how its dialect spells times.

    """

    def __init__(self, schema: Schema) -> None:
        self._schema = schema
        self._whole, self._rest = schema.dialect.time(0)
        self._ways: dict[str, list[tuple[Field, str]]] = {}

    def move(self, type_name: str, message: dict[str, Any], move: Move) -> None:
        """Move every stamp in a message, in place.

        Args:
            type_name: Of the message, as the schema knows it.
            message: It belongs to the caller, with all that is in it.
            move: Gives what a stamp is to say.

        """
        for field, inner in self._way(type_name):
            value = message[field.name]
            for each in [value] if field.length is None else value:
                if inner:
                    self.move(inner, each, move)
                else:
                    self._set(each, move)

    def _set(self, time: dict[str, int], move: Move) -> None:
        moved = move(time[self._whole] * SECOND + time[self._rest])
        time[self._whole], time[self._rest] = divmod(moved, SECOND)

    def _way(self, type_name: str) -> list[tuple[Field, str]]:
        """Return the fields of a type that are stamps, or lead to some by a type."""
        way = self._ways.get(type_name)
        if way is None:
            way = self._ways[type_name] = []
            for field in self._schema.fields(type_name):
                if field.type in TIMES:
                    if field.name == STAMP and field.type == "time":
                        way.append((field, ""))
                elif "/" in field.type and self._way(field.type):
                    way.append((field, field.type))
        return way
