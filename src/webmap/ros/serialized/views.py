"""Views of messages: what they want of each field."""

import types
import typing
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import msgspec

from webmap.base.errors import ProtocolError
from webmap.ros.definitions import Field
from webmap.ros.serialized.schemas import Encoding, parts_of


class Skipped:
    """In place of a type: nobody wants the value."""


class ViewField(NamedTuple):
    """A field of a view."""

    name: str
    """The name of the attribute."""

    hint: Any
    """Its type."""

    required: bool
    """Whether it has no default."""


def view_fields(hint: Any) -> dict[str, ViewField] | None:
    """Return the fields of a view by their names in messages; None if it is no view."""
    if not (isinstance(hint, type) and issubclass(hint, msgspec.Struct)):
        return None
    hints = typing.get_type_hints(hint, include_extras=True)
    return {
        each.encode_name: ViewField(each.name, hints[each.name], each.required)
        for each in msgspec.structs.fields(hint)
    }


def check_view(
    type: str,
    fields: Sequence[Field],
    hint: type[msgspec.Struct],
    view: dict[str, ViewField],
) -> None:
    """Check that a message has all fields that a view needs.

    Args:
        type: The type of the message.
        fields: Its fields.
        hint: The view.
        view: The fields of the view.

    Raises:
        ProtocolError: If one is missing.

    """
    names = {field.name for field in fields}
    for name, known in view.items():
        if known.required and name not in names:
            raise ProtocolError(
                f"{type} has no field {name!r}, which {hint.__name__} needs"
            )


def without_none(hint: Any) -> Any:
    """Return the type besides None, which a message never has, and besides tuples."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        rest = [
            each
            for each in typing.get_args(hint)
            if each is not type(None) and typing.get_origin(each) is not tuple
        ]
        return rest[0] if len(rest) == 1 else hint
    return hint


def is_flat(hint: Any) -> bool:
    """Return whether a tuple of all values may take the place of a view."""
    return any(typing.get_origin(each) is tuple for each in typing.get_args(hint))


def flattened(value: Any) -> list[Any]:
    """Return all values of a struct in order, with those of the structs in it."""
    if not isinstance(value, msgspec.Struct):
        return [value]
    return [each for part in msgspec.structs.astuple(value) for each in flattened(part)]


def item_of(hint: Any) -> Any:
    """Return the type of the items of a list; None if no list is wanted."""
    if hint is Any or hint is list:
        return Any
    return typing.get_args(hint)[0] if typing.get_origin(hint) is list else None


def wanted_of(fields: Sequence[Field], hint: Any) -> Iterator[tuple[Field, str, Any]]:
    """Yield each field, the name of its value, and what is wanted of it.

    Args:
        fields: The fields of a message.
        hint: The view of the message; if it is no view, all fields are wanted.

    """
    view = view_fields(hint)
    for field in fields:
        if view is None:
            yield field, field.name, Skipped if hint is Skipped else Any
        elif field.name in view:
            yield field, view[field.name].name, view[field.name].hint
        else:
            yield field, field.name, Skipped


def is_row(field: Field, hint: Any, encoding: Encoding) -> bool:
    """Return whether a message has a fixed size but for strings, all of them wanted.

    In each message in it something must be wanted, too.
    """
    hint = without_none(hint)
    parts = parts_of(field, encoding)
    if field.is_array:
        return parts is None and field.type != "string" and field.size is not None
    if parts is None:
        return field.type != "string" or hint is not Skipped
    found = [*wanted_of(parts, hint)]
    wanted = hint is Skipped or any(inner is not Skipped for _, _, inner in found)
    return wanted and all(is_row(each, inner, encoding) for each, _, inner in found)
