"""The times of a replay: when a message is due, and the stamps in played messages."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from webmap.ros.definitions import TIMES, Field
from webmap.ros.rosbridge.server.schema import Schema

SECOND = 1_000_000_000
"""One second, in nanoseconds."""

LAST = 2**31 * SECOND
"""The end of the range of a ROS 2 stamp, in nanoseconds since 1970."""


STAMP = "stamp"
"""The name of a field with the time of a message, or of a part of it."""

Move = Callable[[int], int]
"""From nanoseconds since 1970 to nanoseconds since 1970."""


@dataclass(slots=True)
class Pace:
    """Maps the time of a recording to the time at which it is played; uses no clock.

    All times are nanoseconds since 1970. At a rate of 1 all time differences stay the
    same, so a message is as old when it is played as when it was recorded. At another
    rate differences and ages are divided by the rate. Two equal stamps stay equal,
    which frames need.

    Args:
        begin: The time in the recording that is played first.
        now: When it is played.
        rate: Seconds of the recording that are played per second; above 0.
        earliest: The least value of a played stamp. After a jump to another position it
            is the time of the jump, so that stamps never go back.

    """

    begin: int
    now: int
    rate: float = 1.0
    earliest: int = 0

    def due(self, recorded: int) -> int:
        """Return when a time of the recording is played."""
        return self.now + self._scaled(recorded - self.begin, 1 / self.rate)

    def at(self, now: int) -> int:
        """Return the time of the recording that is played now."""
        return self.begin + self._scaled(now - self.now, self.rate)

    def moved(self, stamp: int) -> int:
        """Return the played value of a recorded stamp.

        Zero means no time, and stays. A stamp that would leave the range of stamps
        stays, too, since it came from a clock that was set to another time.
        """
        moved = self.due(stamp)
        if stamp == 0 or not 0 < moved < LAST:
            return stamp
        return max(moved, self.earliest)

    def put_off(self, by: int) -> None:
        """Delay everything by so many nanoseconds."""
        self.now += by

    def _scaled(self, distance: int, factor: float) -> int:
        # A float would round a difference of years to microseconds.
        return distance if factor == 1.0 else round(distance * factor)


class Stamps:
    """Finds the stamps in messages: every time field of that name, at any depth.

    Args:
        schema: The types with their fields, and the dialect of times.

    """

    def __init__(self, schema: Schema) -> None:
        self._schema = schema
        self._whole, self._rest = schema.dialect.time(0)
        self._known: dict[str, list[tuple[Field, str]]] = {}

    def move(self, type_name: str, message: dict[str, Any], move: Move) -> None:
        """Shift every stamp in a message, in place.

        Args:
            type_name: The type of the message, by its name in the schema.
            message: The message; the caller owns it and all its parts.
            move: Returns the new value of a stamp.

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
        """Return the fields of a type that are stamps or contain stamps."""
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
