"""The times of a replay: which moment is due when, and what stamps in messages say."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from webmap.ros.definitions import TIMES, Field
from webmap.ros.rosbridge.server.schema import Schema

SECOND = 1_000_000_000
"""Nanoseconds."""

LAST = 2**31 * SECOND
"""The end of what a stamp of ROS 2 can say, in nanoseconds since 1970."""


STAMP = "stamp"
"""What a field is called that says of when a message, or a part of it, is."""

Move = Callable[[int], int]
"""From nanoseconds since 1970 to nanoseconds since 1970."""


@dataclass(slots=True)
class Pace:
    """Maps the time of a recording to the time at which it is played; no clock.

    All times are nanoseconds since 1970. At a rate of 1 everything keeps its distance
    from everything else, so a message is as old when it is played as it was when it was
    recorded; at another rate distances are divided by the rate, ages too. Two equal
    stamps stay equal, which frames need.

    Args:
        begin: The moment of the recording that is played first.
        now: When it is played.
        rate: How many seconds of the recording are played in one; above 0.

    """

    begin: int
    now: int
    rate: float = 1.0

    def due(self, recorded: int) -> int:
        """Return when a moment of the recording is played."""
        return self.now + self._scaled(recorded - self.begin, 1 / self.rate)

    def at(self, now: int) -> int:
        """Return the moment of the recording that is played now."""
        return self.begin + self._scaled(now - self.now, self.rate)

    def moved(self, stamp: int) -> int:
        """Return what a recorded stamp says when it is played.

        Zero says that there is no time, and stays; so does a stamp that would leave
        what stamps can say, since it came from a clock that was set to another time.
        """
        moved = self.due(stamp)
        return moved if stamp != 0 and 0 < moved < LAST else stamp

    def put_off(self, by: int) -> None:
        """Play everything later than it was due, by so many nanoseconds."""
        self.now += by

    def _scaled(self, distance: int, factor: float) -> int:
        # A float would round a distance of years to microseconds.
        return distance if factor == 1.0 else round(distance * factor)


class Stamps:
    """Finds the stamps in messages: every time field called so, however deep.

    Args:
        schema: Knows the fields of the types, and how its dialect spells times.

    """

    def __init__(self, schema: Schema) -> None:
        self._schema = schema
        self._whole, self._rest = schema.dialect.time(0)
        self._known: dict[str, list[tuple[Field, str]]] = {}

    def move(self, type_name: str, message: dict[str, Any], move: Move) -> None:
        """Move every stamp in a message, in place.

        Args:
            type_name: Of the message, as the schema knows it.
            message: It belongs to the caller, with all that is in it.
            move: Gives what a stamp is to say.

        """
        for field, inner in self._leading(type_name):
            value = message[field.name]
            for each in value if field.is_array else [value]:
                if inner:
                    self.move(inner, each, move)
                else:
                    self._set(each, move)

    def _set(self, time: dict[str, int], move: Move) -> None:
        moved = move(time[self._whole] * SECOND + time[self._rest])
        time[self._whole], time[self._rest] = divmod(moved, SECOND)

    def _leading(self, type_name: str) -> list[tuple[Field, str]]:
        """Return the fields of a type that are stamps, or lead to some by a type."""
        found = self._known.get(type_name)
        if found is None:
            found = self._known[type_name] = []
            for field in self._schema.fields(type_name):
                if field.type in TIMES:
                    if field.name == STAMP and field.type == "time":
                        found.append((field, ""))
                elif field.fields is not None and self._leading(field.type):
                    found.append((field, field.type))
        return found
