"""Message types described for people and for clients that build messages."""

from typing import Any

from webmap.sim.rosbridge.dialect import canonical
from webmap.sim.rosbridge.schema import DTYPES, SCALARS, TIMES, Field, Schema

_RULE = "=" * 80


def type_definitions(schema: Schema, type_name: str) -> list[dict[str, Any]]:
    """Return rosapi's type definitions of a type and of all that it holds.

    Raises:
        UnknownType: If the schema does not know it.

    """
    return [_definition(schema, name) for name in _closure(schema, type_name)]


def definition_text(schema: Schema, type_name: str) -> str:
    """Return the text of a type's definition and of all that it holds."""
    first, *others = (
        name for name in _closure(schema, type_name) if name not in SCALARS
    )
    parts = [_text(schema, first)]
    parts += [f"{_RULE}\nMSG: {name}\n{_text(schema, name)}" for name in others]
    return "\n".join(parts)


def _closure(schema: Schema, type_name: str) -> list[str]:
    found = [canonical(type_name)]
    for name in found:
        for field in _fields(schema, name):
            is_part = field.type not in SCALARS or field.type in TIMES
            if is_part and field.type not in found:
                found.append(field.type)
    return found


def _fields(schema: Schema, name: str) -> tuple[Field, ...]:
    if name not in TIMES:
        return schema.fields(name)
    whole, rest = schema.dialect.time(0)
    return Field(whole, "int32", None), Field(
        rest, "uint32" if schema.dialect.is_ros2 else "int32", None
    )


def _spell(schema: Schema, name: str) -> str:
    # Definitions say pkg/Name in both dialects.
    if name in TIMES and schema.dialect.is_ros2:
        return f"builtin_interfaces/{name.capitalize()}"
    return name


def _definition(schema: Schema, name: str) -> dict[str, Any]:
    fields = _fields(schema, name)
    return {
        "type": _spell(schema, name),
        "fieldnames": [field.name for field in fields],
        "fieldtypes": [_spell(schema, field.type) for field in fields],
        # -1 is a single value here, 0 a sequence.
        "fieldarraylen": [_array_length(field) for field in fields],
        "examples": [_example(field) for field in fields],
        "constnames": [],
        "constvalues": [],
    }


def _array_length(field: Field) -> int:
    if field.length is None:
        return -1
    return max(field.length, 0)


def _example(field: Field) -> str:
    if field.length is not None:
        return "[]"
    if field.type == "string":
        return ""
    if field.type == "bool":
        return "False"
    if field.type in DTYPES:
        return "0.0" if field.type.startswith("float") else "0"
    return "{}"


def _text(schema: Schema, name: str) -> str:
    lines = []
    for field in schema.fields(name):
        size = "" if field.length is None else f"[{max(field.length, 0) or ''}]"
        lines.append(f"{_spell(schema, field.type)}{size} {field.name}\n")
    return "".join(lines)
