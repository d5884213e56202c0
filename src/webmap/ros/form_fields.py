"""What a message is made of, so that a person can be asked for it.

The language is that of ``.msg`` and ``.srv`` files, of ROS 1 and of ROS 2.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from webmap.errors import ConfigError
from webmap.ros.definitions import definition
from webmap.ros.names import split_type

INTEGERS = {
    "int8": (-(2**7), 2**7 - 1),
    "uint8": (0, 2**8 - 1),
    "byte": (0, 2**8 - 1),
    "char": (0, 2**8 - 1),
    "int16": (-(2**15), 2**15 - 1),
    "uint16": (0, 2**16 - 1),
    "int32": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1),
    "int64": (-(2**63), 2**63 - 1),
    "uint64": (0, 2**64 - 1),
}
"""The range of each type of whole numbers."""

FLOATS = {"float32": 3.4028234663852886e38, "float64": 1.7976931348623157e308}
"""The largest number of each type."""

TIMES = {
    "time": "time",
    "duration": "duration",
    "builtin_interfaces/Time": "time",
    "builtin_interfaces/Duration": "duration",
}
"""What is asked for in seconds."""

_PLAIN = {"Header": "std_msgs/Header"}
_LINE = re.compile(
    r"(?P<type>[A-Za-z][A-Za-z0-9_/]*)"
    r"(?:<=(?P<longest>[0-9]+))?"
    r"(?P<array>\[(?P<bound><=)?(?P<size>[0-9]*)\])?"
    r"\s+(?P<name>[A-Za-z][A-Za-z0-9_]*)\s*(?P<rest>.*)"
)
MAX_DEPTH = 8
"""How deep messages are nested in a form."""

MAX_FIELDS = 400
"""Fields of one form, all depths together."""


class UnknownType(ConfigError):
    """A type whose definition is not known.

    Attributes:
        type: Its name.

    """

    def __init__(self, type: str) -> None:
        super().__init__(f"the fields of {type} are not known here")
        self.type = type


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message."""

    name: str
    type: str
    """A scalar's type, ``time``, ``duration``, or the name of a message type."""

    fields: tuple["Field", ...] | None = None
    """Those of a message; None for what is a scalar."""

    is_array: bool = False
    size: int | None = None
    """Elements of an array of fixed size, or the most of a bounded one."""

    is_fixed: bool = False
    longest: int | None = None
    """Characters that a text may have; None if nothing bounds it."""

    default: Any = None
    """What ROS takes if it is left out; None for zero, false or an empty text."""

    constants: Mapping[str, Any] | None = None
    """Names for its values."""


Lookup = Callable[[str], str | None]


def fields_of(type: str, lookup: Lookup = definition) -> tuple[Field, ...]:
    """Return the fields of a message, or of the request of a service.

    Args:
        type: In either dialect.
        lookup: Returns the text of a definition; of those that are shipped, if not
            given.

    Raises:
        UnknownType: If a definition is missing, of the type or of a part of it.
        ConfigError: If a definition makes no sense.

    """
    budget = [MAX_FIELDS]
    return _fields(str(split_type(type)), lookup, (), budget)


def _fields(
    type: str, lookup: Lookup, outer: tuple[str, ...], budget: list[int]
) -> tuple[Field, ...]:
    if type in outer or len(outer) >= MAX_DEPTH:
        raise ConfigError(f"{type} is nested too deep: in {', '.join(outer)}")
    text = lookup(type)
    if text is None:
        raise UnknownType(type)
    constants: list[tuple[str, str, Any]] = []
    found: list[Field] = []
    for line in text.partition("---")[0].splitlines():
        plain = _without_comment(line)
        if not plain:
            continue
        match = _LINE.fullmatch(plain)
        if match is None:
            raise ConfigError(f"{type}: {plain!r} is no field")
        if match["rest"].startswith("="):
            value = _constant(match["type"], match["rest"][1:].strip())
            constants.append((match["type"], match["name"], value))
            continue
        budget[0] -= 1
        if budget[0] < 0:
            raise ConfigError(f"{type}: more than {MAX_FIELDS} fields are no form")
        found.append(_field(match, type, lookup, (*outer, type), budget))
    return tuple(_named(field, found, constants) for field in found)


def _field(
    match: re.Match[str],
    owner: str,
    lookup: Lookup,
    outer: tuple[str, ...],
    budget: list[int],
) -> Field:
    kind = TIMES.get(match["type"], match["type"])
    inner = None
    if kind not in (*INTEGERS, *FLOATS, *TIMES.values(), "bool", "string", "wstring"):
        kind = _PLAIN.get(kind, kind)
        if "/" not in kind:  # of the same package
            kind = f"{owner.partition('/')[0]}/{kind}"
        kind = str(split_type(kind))
        inner = _fields(kind, lookup, outer, budget)
    rest = match["rest"]
    array = match["array"] is not None
    return Field(
        name=match["name"],
        type="string" if kind == "wstring" else kind,
        fields=inner,
        is_array=array,
        size=int(match["size"]) if match["size"] else None,
        is_fixed=bool(match["size"]) and not match["bound"],
        longest=int(match["longest"]) if match["longest"] else None,
        default=None if inner or array or not rest else _constant(kind, rest),
    )


def _named(
    field: Field, among: Sequence[Field], constants: Sequence[tuple[str, str, Any]]
) -> Field:
    """Give a field the constants that are names for its values, if there are any.

    Those whose names begin with its own are; or all of its type, if no other field
    has that type and none of them is called like a field.
    """
    same = {name: value for type, name, value in constants if type == field.type}
    prefix = f"{field.name.upper()}_"
    mine = {name: value for name, value in same.items() if name.startswith(prefix)}
    alone = [each.type for each in among].count(field.type) == 1
    others = any(
        name.startswith(f"{each.name.upper()}_") for name in same for each in among
    )
    if not mine and alone and not others:
        mine = same
    if not mine or field.is_array or field.fields is not None:
        return field
    return Field(
        field.name, field.type, longest=field.longest, default=field.default,
        constants=mine,
    )  # fmt: skip


def _without_comment(line: str) -> str:
    # A text constant may hold the sign of a comment; no other line does.
    if re.match(r"\s*w?string\s+\w+\s*=", line):
        return line.strip()
    return line.partition("#")[0].strip()


def _constant(type: str, text: str) -> Any:
    try:
        if type in INTEGERS:
            return int(text, 0)
        if type in FLOATS:
            return float(text)
    except ValueError:
        raise ConfigError(f"{text!r} is no {type}") from None
    if type == "bool":
        return text.strip().lower() in ("true", "1")
    if type in ("string", "wstring"):
        quoted = len(text) > 1 and text[0] == text[-1] and text[0] in "\"'"
        return text[1:-1] if quoted else text
    return None
