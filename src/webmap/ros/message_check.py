"""Check of plain data against the definition of a message, field by field."""

import math
from collections.abc import Mapping, Sequence, Sized
from dataclasses import replace
from typing import Any

from webmap.base.errors import ConfigError
from webmap.ros.definitions import FLOATS, INTEGERS, TIMES, Field

MAX_TEXT = 10_000
"""Most characters of one string that a person enters."""


class Misfit(ConfigError):
    """A value does not fit its field.

    Attributes:
        path: Where the field is in the message: ``pose.position.x``, ``ranges[3]``;
            empty for the message as a whole.
        reason: What is wrong with the value.
        value: The value.
        expected: The expected value, as a phrase; empty if there is no such field.

    """

    def __init__(
        self, reason: str, path: str = "", *, value: Any = None, expected: str = ""
    ) -> None:
        super().__init__(reason)
        self.reason = reason
        self.path = path
        self.value = value
        self.expected = expected

    def __str__(self) -> str:
        return f"{self.path}: {self.reason}" if self.path else self.reason

    def inside(self, place: str) -> "Misfit":
        """Return the same error, with ``place`` before the path."""
        joint = "" if not self.path or self.path.startswith("[") else "."
        self.path = f"{place}{joint}{self.path}"
        return self


class MessageCheck:
    """Converts plain data to a message of its type, or raises :class:`Misfit`.

    This class is as strict as a form: absent fields stay absent, numbers are finite,
    and a time may be a number of seconds. Subclasses convert messages from other
    sources.

    Args:
        ros2: Whether times have the field names of ROS 2.

    """

    def __init__(self, *, ros2: bool) -> None:
        self.ros2 = ros2

    def message(self, fields: Sequence[Field], value: Any) -> dict[str, Any]:
        """Return a message with the fields in the order of the definition.

        Args:
            fields: The fields of the type.
            value: The values by the names of the fields.

        Raises:
            Misfit: If a value does not fit; its path names the field.

        """
        if not isinstance(value, Mapping):
            raise wrong(value, "a table of fields")
        made: dict[str, Any] = {}
        found = 0
        for field in fields:
            try:
                if field.name not in value:
                    self.absent(field, made)
                    continue
                found += 1
                each = value[field.name]
                made[field.name] = (
                    self.array(field, each) if field.is_array else self.one(field, each)
                )
            except Misfit as error:
                if field.name not in value:  # a wrong name is the better reason
                    check_names(fields, value)
                raise error.inside(field.name) from None
        if found < len(value):
            check_names(fields, value)
        return made

    def absent(self, field: Field, made: dict[str, Any]) -> None:
        """Handle an absent field: here, leave it absent."""

    def array(self, field: Field, value: Any) -> Any:
        """Return an array of the right size, each of whose elements was checked."""
        if not isinstance(value, list | tuple):
            raise wrong(value, expectation(field))
        check_size(field, value)
        made = []
        for index, each in enumerate(value):
            try:
                made.append(self.one(field, each))
            except Misfit as error:
                raise error.inside(f"[{index}]") from None
        return made

    def one(self, field: Field, value: Any) -> Any:
        """Return a value that is not an array, or one element of an array."""
        if field.fields is not None:
            return self.message(field.fields, value)
        if field.type in FLOATS:
            return self.number(field, value)
        if field.type in INTEGERS:
            return self.whole(field, value)
        if field.type in TIMES:
            return self.time(field, value)
        return self.text(field, value) if field.type == "string" else self.truth(value)

    def number(self, field: Field, value: Any) -> float:
        """Return a finite number that the type of the field can hold."""
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not is_number or not abs(value) <= FLOATS[field.type]:  # NaN or infinite
            raise wrong(value, "a number")
        return float(value)

    def whole(self, field: Field, value: Any) -> int:
        """Return an integer that the type of the field can hold."""
        low, high = INTEGERS[field.type]
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        if not is_whole or not low <= value <= high:
            raise wrong(value, expectation(replace(field, is_array=False)))
        return int(value)

    def truth(self, value: Any) -> bool:
        """Return a boolean; 0 and 1 are refused."""
        if not isinstance(value, bool):
            raise wrong(value, "true or false")
        return value

    def text(self, field: Field, value: Any) -> str:
        """Return a string that is not longer than the field allows."""
        longest = MAX_TEXT if field.longest is None else field.longest
        if not isinstance(value, str) or len(value) > longest:
            raise wrong(value, expectation(replace(field, is_array=False)))
        return value

    def time(self, field: Field, value: Any) -> dict[str, int]:
        """Return a time or a duration, from a number of seconds or from its fields."""
        number = seconds(value)
        fits = isinstance(number, int | float) and not isinstance(number, bool)
        if not fits or not math.isfinite(number) or abs(number) >= 2**31:
            raise wrong(value, "a number of seconds")
        if field.type == "time" and number < 0:
            raise wrong(value, "seconds from 0")
        whole = math.floor(number)
        rest = round((number - whole) * 1e9)
        return (
            self.spelled(whole + 1, 0) if rest == 10**9 else self.spelled(whole, rest)
        )

    def spelled(self, whole: int, rest: int) -> dict[str, int]:
        """Return seconds and nanoseconds under the field names of the dialect."""
        if self.ros2:
            return {"sec": whole, "nanosec": rest}
        return {"secs": whole, "nsecs": rest}


def check_names(fields: Sequence[Field], value: Mapping[str, Any]) -> None:
    """Check that each name is that of a field.

    Raises:
        Misfit: If one is not; its path is the name.

    """
    names = [field.name for field in fields]
    for name in value:
        if name not in names:
            reason = f"no such field; there are {', '.join(names) or 'none'}"
            raise Misfit(reason, str(name))


def check_size(field: Field, value: Sized) -> None:
    """Check the number of elements of an array.

    Raises:
        Misfit: If the array has more or fewer elements than its field allows.

    """
    count = len(value)
    fixed = field.size is not None and count != field.size
    if fixed or (field.most is not None and count > field.most):
        expected = expectation(field)
        reason = f"got {count} values, expected {expected}"
        raise Misfit(reason, value=value, expected=expected)


def wrong(value: Any, expected: str) -> Misfit:
    """Return the error for a value of the wrong kind."""
    reason = f"got {show(value)}, expected {expected}"
    return Misfit(reason, value=value, expected=expected)


def expectation(field: Field) -> str:
    """Return a description of the values that a field accepts."""
    if field.is_array:
        most = "" if field.most is None else f"at most {field.most} "
        many = most if field.size is None else f"{field.size} "
        return f"{many}values of {field.type}"
    if field.type in INTEGERS:
        low, high = INTEGERS[field.type]
        return f"a whole number from {low} to {high}"
    if field.type in FLOATS:
        return "a number"
    if field.type in TIMES:
        return "a number of seconds"
    if field.type == "bool":
        return "true or false"
    return "a text" + ("" if field.longest is None else f" of {field.longest} at most")


def seconds(value: Any) -> Any:
    """Return a time of either dialect in seconds, and any other value unchanged."""
    if not isinstance(value, Mapping):
        return value
    whole = value.get("secs", value.get("sec", 0))
    rest = value.get("nsecs", value.get("nanosec", 0))
    try:
        return whole + rest / 1e9
    except TypeError:
        return value


def show(value: Any) -> str:
    """Return a value as shown in errors: short, without control characters."""
    text = value if isinstance(value, str) else repr(value)
    text = "".join(c if c.isprintable() else "?" for c in text[:41])
    text = f"{text[:40]}..." if len(text) > 40 else text
    return f'"{text}"' if isinstance(value, str) else text
