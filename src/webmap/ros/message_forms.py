"""From what people fill in to a message that fits its type, or words why it does not.

A value is named by its way in the message, such as ``pose.position.x``. What is filled
in is text, ``True`` or ``False``; what a configuration gives is plain data.
"""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from webmap.errors import ConfigError
from webmap.ros.form_fields import FLOATS, INTEGERS, Field

MAX_TEXT = 10_000
"""Characters of one entry."""


class FormError(ConfigError):
    """Something in a form is not what its field takes.

    Attributes:
        path: The way to the field.

    """

    def __init__(self, path: str, words: str) -> None:
        super().__init__(f"{path}: {words}" if path else words)
        self.path = path
        self.words = words


def initial(fields: Sequence[Field], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return a whole message: what is given, and the defaults for the rest.

    Args:
        fields: Those of the type.
        given: Plain data that :func:`checked` has let pass.

    """
    return {field.name: _initial(field, given.get(field.name)) for field in fields}


def checked(
    fields: Sequence[Field], given: Any, path: str = "", *, ros2: bool = False
) -> dict[str, Any]:
    """Return plain data that fits a type; what is left out stays so.

    Raises:
        FormError: If it does not fit; the field is named.

    """
    if not isinstance(given, Mapping):
        raise FormError(path, f"got {_show(given)}, expected a table of fields")
    known = {field.name: field for field in fields}
    for name in given:
        if name not in known:
            listed = ", ".join(known) or "none"
            raise FormError(_way(path, str(name)), f"no such field; there are {listed}")
    return {
        name: _value(known[name], value, _way(path, name), ros2)
        for name, value in given.items()
    }


def filled_in(
    fields: Sequence[Field], entries: Mapping[str, Any], *, ros2: bool = False
) -> dict[str, Any]:
    """Return the message that entries make.

    Args:
        fields: Those of the type.
        entries: What was filled in, by the way to each field; see :func:`leaves`.
        ros2: Whether times are written as ROS 2 has them.

    Raises:
        FormError: If an entry is not what its field takes; the field is named.

    """

    def fill(fields: Sequence[Field], path: str) -> dict[str, Any]:
        message = {}
        for field in fields:
            way = _way(path, field.name)
            if field.fields is not None and not field.is_array:
                message[field.name] = fill(field.fields, way)
            elif way in entries:
                value = _from_entry(field, entries[way], way)
                message[field.name] = _value(field, value, way, ros2)
        return message

    return fill(fields, "")


def leaves(fields: Sequence[Field], path: str = "") -> list[tuple[str, Field]]:
    """Return what is filled in, with its way, in order."""
    found: list[tuple[str, Field]] = []
    for field in fields:
        way = _way(path, field.name)
        if field.fields is not None and not field.is_array:
            found += leaves(field.fields, way)
        else:
            found.append((way, field))
    return found


def entry_of(field: Field, value: Any) -> str | bool:
    """Return a value as it stands in a form."""
    if field.is_array:
        if field.fields is not None:
            return json.dumps(value or [], ensure_ascii=False)
        return ", ".join(str(each) for each in value or [])
    if field.type == "bool":
        return bool(value)
    return "" if value is None else str(value)


def expectation(field: Field) -> str:
    """Return in words what a field takes."""
    if field.is_array:
        many = "" if field.size is None else f"{field.size} "
        most = "" if field.is_fixed or field.size is None else "at most "
        if field.fields is not None:
            return f"{most}{many}of {field.type} as JSON, in brackets"
        return f"{most}{many}values of {field.type}, with commas between them"
    if field.type in INTEGERS:
        low, high = INTEGERS[field.type]
        return f"a whole number from {low} to {high}"
    if field.type in FLOATS:
        return "a number"
    if field.type in ("time", "duration"):
        return "a number of seconds"
    if field.type == "bool":
        return "true or false"
    return "a text" + ("" if field.longest is None else f" of {field.longest} at most")


def _initial(field: Field, given: Any) -> Any:
    if field.fields is not None and not field.is_array:
        return initial(field.fields, given or {})
    if given is not None:
        return seconds(given) if field.type in ("time", "duration") else given
    if field.is_array:
        count = field.size if field.is_fixed and field.size else 0
        empty = _zero(field) if field.fields is None else initial(field.fields, {})
        return [empty] * count
    return _zero(field) if field.default is None else field.default


def seconds(value: Any) -> Any:
    """Return a time of either dialect in seconds; anything else as it is."""
    if not isinstance(value, Mapping):
        return value
    whole = value.get("secs", value.get("sec", 0))
    rest = value.get("nsecs", value.get("nanosec", 0))
    return whole + rest / 1e9


def _zero(field: Field) -> Any:
    if field.type in INTEGERS or field.type in FLOATS:
        return 0
    if field.type in ("time", "duration"):
        return 0
    return False if field.type == "bool" else ""


def _from_entry(field: Field, entry: Any, path: str) -> Any:
    """Return what an entry says; text of a number stays text if it is none."""
    if isinstance(entry, str) and len(entry) > MAX_TEXT:
        raise FormError(path, f"at most {MAX_TEXT} characters are taken")
    if field.is_array and isinstance(entry, str):
        if field.fields is not None:
            return _json(entry, path)
        parts = [part.strip() for part in entry.split(",")] if entry.strip() else []
        return [_scalar_entry(field, part) for part in parts]
    return _scalar_entry(field, entry)


def _json(entry: str, path: str) -> Any:
    try:
        return json.loads(entry or "[]")
    except (ValueError, RecursionError) as error:
        raise FormError(path, f"this is no JSON: {error}") from None


def _scalar_entry(field: Field, entry: Any) -> Any:
    if not isinstance(entry, str):
        return entry
    text = entry.strip()
    if field.type == "bool" and text.lower() in ("true", "false"):
        return text.lower() == "true"
    number = field.type in INTEGERS or field.type in (*FLOATS, "time", "duration")
    if not number or len(text) > 40:
        return entry
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return entry


def _value(field: Field, value: Any, path: str, ros2: bool) -> Any:
    if not field.is_array:
        return _single(field, value, path, ros2)
    if not isinstance(value, list | tuple):
        raise FormError(path, f"got {_show(value)}, expected {expectation(field)}")
    count, size = len(value), field.size
    if size is not None and (count > size or (field.is_fixed and count != size)):
        raise FormError(path, f"got {count} values, expected {expectation(field)}")
    return [
        _single(field, each, f"{path}[{index}]", ros2)
        for index, each in enumerate(value)
    ]


def _single(field: Field, value: Any, path: str, ros2: bool) -> Any:
    if field.fields is not None:
        return checked(field.fields, value, path, ros2=ros2)
    if field.type in ("time", "duration"):
        return _time(field, value, path, ros2)
    if not _fits(field, value):
        words = expectation(Field(field.name, field.type, longest=field.longest))
        raise FormError(path, f"got {_show(value)}, expected {words}")
    return float(value) if field.type in FLOATS else value


def _fits(field: Field, value: Any) -> bool:
    if field.type == "bool":
        return isinstance(value, bool)
    if field.type == "string":
        longest = field.longest or MAX_TEXT
        return isinstance(value, str) and len(value) <= longest
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    if field.type in INTEGERS:
        low, high = INTEGERS[field.type]
        return isinstance(value, int) and low <= value <= high
    return abs(value) <= FLOATS[field.type]  # neither NaN nor infinite


def _time(field: Field, value: Any, path: str, ros2: bool) -> dict[str, int]:
    number = seconds(value)
    fits = isinstance(number, int | float) and not isinstance(number, bool)
    if not fits or not math.isfinite(number) or abs(number) >= 2**31:
        raise FormError(path, f"got {_show(value)}, expected a number of seconds")
    if field.type == "time" and number < 0:
        raise FormError(path, f"got {_show(value)}, expected seconds from 0")
    whole = math.floor(number)
    rest = round((number - whole) * 1e9)
    if rest == 10**9:
        whole, rest = whole + 1, 0
    names = ("sec", "nanosec") if ros2 else ("secs", "nsecs")
    return dict(zip(names, (whole, rest), strict=True))


def _way(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _show(value: Any) -> str:
    text = value if isinstance(value, str) else repr(value)
    text = "".join(c if c.isprintable() else "?" for c in text[:41])
    text = f"{text[:40]}..." if len(text) > 40 else text
    return f'"{text}"' if isinstance(value, str) else text
