"""Forms for messages: the fields that people fill in, and the resulting message.

A value is named by its path in the message, such as ``pose.position.x``. People fill in
text, ``True`` or ``False``; a configuration gives plain data.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from webmap.base.errors import ConfigError
from webmap.ros.definitions import FLOATS, INTEGERS, TIMES, Definitions, Field, shipped
from webmap.ros.message_check import (
    MAX_TEXT,
    MessageCheck,
    Misfit,
    expectation,
    seconds,
)

MAX_FIELDS = 400
"""Most fields of one form, over all depths."""


def fields_of(type: str, known: Definitions | None = None) -> tuple[Field, ...]:
    """Return the fields of a message, or of the request of a service.

    Args:
        type: The type, in either dialect.
        known: The definitions; those included in WebMap if not given.

    Raises:
        UnknownType: If the definition of the type or of a part of it is missing.
        ConfigError: If a definition is invalid, or too long for a form.

    """
    found = (known or shipped(ros2=type.count("/") == 2)).definition(type)
    return _form_fields(found.name, found.fields, [MAX_FIELDS])


def _form_fields(
    owner: str, fields: Sequence[Field], budget: list[int]
) -> tuple[Field, ...]:
    """Return the fields that people fill in, at all depths."""
    kept = []
    for field in fields:
        if owner == "std_msgs/Header" and field.name == "seq":
            continue  # in ROS 1 the publisher sets it
        budget[0] -= 1
        if budget[0] < 0:
            raise ConfigError(
                f"{owner}: more than {MAX_FIELDS} fields are too many for a form"
            )
        if field.fields is not None:
            inner = _form_fields(field.type, field.fields, budget)
            field = replace(field, fields=inner)
        kept.append(field)
    return tuple(kept)


def initial(fields: Sequence[Field], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return a complete message: the given values, and defaults for the rest.

    Args:
        fields: The fields of the type.
        given: Plain data checked by :func:`checked`.

    """
    return {field.name: _initial(field, given.get(field.name)) for field in fields}


def checked(
    fields: Sequence[Field], given: Any, *, ros2: bool = False
) -> dict[str, Any]:
    """Return plain data that fits a type; absent fields stay absent.

    Raises:
        Misfit: If a value does not fit; its path names the field.

    """
    return MessageCheck(ros2=ros2).message(fields, given)


def filled_in(
    fields: Sequence[Field], entries: Mapping[str, Any], *, ros2: bool = False
) -> dict[str, Any]:
    """Return the message that the entries make.

    Args:
        fields: The fields of the type.
        entries: The entered values, by the path of each field; see :func:`leaves`.
        ros2: Whether times have the field names of ROS 2.

    Raises:
        Misfit: If an entry does not fit its field; its path names the field.

    """

    def fill(fields: Sequence[Field], outer: str) -> dict[str, Any]:
        message = {}
        for field in fields:
            path = _joined(outer, field.name)
            if field.fields is not None and not field.is_array:
                message[field.name] = fill(field.fields, path)
            elif path in entries:
                message[field.name] = _from_entry(field, entries[path], path)
        return message

    return checked(fields, fill(fields, ""), ros2=ros2)


def leaves(fields: Sequence[Field], outer: str = "") -> list[tuple[str, Field]]:
    """Return the fields to fill in, each with its path, in order."""
    found: list[tuple[str, Field]] = []
    for field in fields:
        path = _joined(outer, field.name)
        if field.fields is not None and not field.is_array:
            found += leaves(field.fields, path)
        else:
            found.append((path, field))
    return found


def entry_of(field: Field, value: Any) -> str | bool:
    """Return a value as shown in a form."""
    if field.is_array:
        if field.fields is not None:
            return json.dumps(value or [], ensure_ascii=False)
        return ", ".join(str(each) for each in value or [])
    if field.type == "bool":
        return bool(value)
    return "" if value is None else str(value)


def hint(field: Field) -> str:
    """Return a hint how to fill in a field; empty if its type is enough."""
    if field.is_array:
        form = "as JSON, in brackets" if field.fields else "with commas between them"
        return f"{expectation(field)}, {form}"
    return expectation(field) if field.type in TIMES else ""


def _initial(field: Field, given: Any) -> Any:
    if field.fields is not None and not field.is_array:
        return initial(field.fields, given or {})
    if given is not None:
        return seconds(given) if field.type in TIMES else given
    if field.is_array:
        empty = _zero(field) if field.fields is None else initial(field.fields, {})
        return [empty] * (field.size or 0)
    return _zero(field) if field.default is None else field.default


def _zero(field: Field) -> Any:
    if field.type in INTEGERS or field.type in FLOATS or field.type in TIMES:
        return 0
    return False if field.type == "bool" else ""


def _from_entry(field: Field, entry: Any, path: str) -> Any:
    """Return the value of an entry; text that is not a number stays text."""
    if isinstance(entry, str) and len(entry) > MAX_TEXT:
        raise Misfit(f"at most {MAX_TEXT} characters are allowed", path)
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
        raise Misfit(f"this is not JSON: {error}", path) from None


def _scalar_entry(field: Field, entry: Any) -> Any:
    if not isinstance(entry, str):
        return entry
    text = entry.strip()
    if field.type == "bool" and text.lower() in ("true", "false"):
        return text.lower() == "true"
    number = field.type in INTEGERS or field.type in (*FLOATS, *TIMES)
    if not number or len(text) > 40:
        return entry
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return entry


def _joined(outer: str, name: str) -> str:
    return f"{outer}.{name}" if outer else name
