"""The catalogue of message and service definitions, and the parser of their texts.

The texts are in the language of ``.msg``, ``.srv`` and ``.action`` files of ROS 1 and
ROS 2. One text may hold many types, as in bags and in the answers of bridges: a line
such as ``MSG: std_msgs/Bool``, ``SRV: std_srvs/SetBool`` or ``ACTION: my_msgs/Dock``
begins each type. The definitions included in WebMap are in ``msg/``, one file for each
package; the files ``ros1.msg`` and ``ros2.msg`` hold the types whose fields differ
between the two.

Names have the form of ROS 1: ``std_msgs/Bool``. The request of a service is
``std_srvs/SetBoolRequest``, its response ``std_srvs/SetBoolResponse``. The messages of
an action have the names of the dialect.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Any

from webmap.base.errors import ConfigError
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
"""The range of each integer type."""

FLOATS = {"float32": 3.4028234663852886e38, "float64": 1.7976931348623157e308}
"""The largest number of each floating-point type."""

OCTETS = ("uint8", "byte", "char")
"""The types of one byte; an array of them is bytes."""

TIMES = ("time", "duration")
"""The types of a time and of a duration, with these names in both dialects."""

SCALARS = (*INTEGERS, *FLOATS, *TIMES, "bool", "string")
"""The types without fields."""

MAX_DEPTH = 16
"""Greatest depth of nested messages."""

_OTHER_NAMES = {
    "builtin_interfaces/Time": "time",
    "builtin_interfaces/Duration": "duration",
    "wstring": "string",
    "Header": "std_msgs/Header",
}
_HEAD = re.compile(r"(MSG|SRV|ACTION):\s*(\S+)\s*")
_LINE = re.compile(
    r"(?P<type>[A-Za-z][A-Za-z0-9_/]*)"
    r"(?:<=(?P<longest>[0-9]{1,10}))?"
    r"(?P<array>\[(?P<bound><=)?(?P<size>[0-9]{0,10})\])?"
    r"\s+(?P<name>[A-Za-z][A-Za-z0-9_]*)\s*(?P<rest>.*)"
)
_GOAL_ID = "unique_identifier_msgs/UUID goal_id\n"
_ACTION_HEAD = "std_msgs/Header header\nactionlib_msgs/"


class UnknownType(ConfigError):
    """A type without a known definition.

    Attributes:
        type: The name of the type.

    """

    def __init__(self, type: str) -> None:
        super().__init__(f"the fields of {type} are not known here")
        self.type = type


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message."""

    name: str
    type: str
    """A scalar type, ``time``, ``duration``, or the name of a message type."""

    fields: tuple["Field", ...] | None = None
    """The fields of a message type; None for a scalar."""

    is_array: bool = False
    size: int | None = None
    """Number of elements of an array of fixed size."""

    most: int | None = None
    """Most elements of a bounded array."""

    longest: int | None = None
    """Most characters of a string; None if unbounded."""

    default: Any = None
    """The default value in ROS; None for zero, false or an empty string."""

    constants: Mapping[str, Any] | None = None
    """The constants that name values of the field."""


@dataclass(frozen=True, slots=True)
class Constant:
    """A named value in a definition."""

    name: str
    type: str
    value: Any


@dataclass(frozen=True, slots=True)
class Definition:
    """The definition of one message type: fields and constants."""

    name: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...] = ()


class Definitions:
    """The definitions of types, found by name.

    Args:
        texts: Texts by the names of types; they replace the included ones.
        ros2: Whether the definitions are those of ROS 2.
        included: Whether types without a text have those included in WebMap.

    """

    def __init__(
        self,
        texts: Mapping[str, str] | None = None,
        *,
        ros2: bool,
        included: bool = True,
    ) -> None:
        self.ros2 = ros2
        self._texts = {**(_shipped(ros2) if included else {}), **(texts or {})}
        self._read: dict[str, Definition] = {}

    def __contains__(self, name: str) -> bool:
        return name in self._texts

    def __iter__(self) -> Iterator[str]:
        return iter(self._texts)

    def text(self, name: str) -> str:
        """Return the text of one type alone; ``name`` is in the form of ROS 1."""
        return self._texts[name]

    def definition(self, type: str) -> Definition:
        """Return the definition of a message, or of the request of a service.

        Args:
            type: The type, in either dialect.

        Raises:
            UnknownType: If the definition of the type or of a part of it is missing.
            ConfigError: If a definition is invalid.

        """
        name = str(split_type(type))
        if name not in self._texts and f"{name}Request" in self._texts:
            name += "Request"
        return self._definition(name, ())

    def _definition(self, name: str, outer: tuple[str, ...]) -> Definition:
        known = self._read.get(name)
        if known is not None:
            return known
        if name in outer or len(outer) >= MAX_DEPTH:
            raise ConfigError(f"{name} is nested too deep: in {', '.join(outer)}")
        if name not in self._texts:
            raise UnknownType(name)
        constants: list[Constant] = []
        found: list[Field] = []
        for line in self._texts[name].splitlines():
            plain = _without_comment(line)
            if not plain:
                continue
            match = _LINE.fullmatch(plain)
            if match is None:
                raise ConfigError(f"{name}: {plain!r} is no field")
            if match["rest"].startswith("="):
                value = _constant(match["type"], match["rest"][1:].strip())
                constants.append(Constant(match["name"], match["type"], value))
            else:
                found.append(self._field(match, (*outer, name)))
        fields = tuple(_named(field, found, constants) for field in found)
        made = self._read[name] = Definition(name, fields, tuple(constants))
        return made

    def _field(self, match: re.Match[str], outer: tuple[str, ...]) -> Field:
        kind = _OTHER_NAMES.get(match["type"], match["type"])
        inner = None
        if kind not in SCALARS:
            if "/" not in kind:  # in the same package
                kind = f"{outer[-1].partition('/')[0]}/{kind}"
            kind = str(split_type(kind))
            inner = self._definition(kind, outer).fields
        rest, array = match["rest"], match["array"] is not None
        size = int(match["size"]) if match["size"] else None
        return Field(
            name=match["name"],
            type=kind,
            fields=inner,
            is_array=array,
            size=None if match["bound"] else size,
            most=size if match["bound"] else None,
            longest=int(match["longest"]) if match["longest"] else None,
            default=None if inner or array or not rest else _constant(kind, rest),
        )


def split_texts(text: str, name: str | None = None, *, ros2: bool) -> dict[str, str]:
    """Return the text of each type in one text, by the names of the types.

    Args:
        text: Types one after the other.
        name: The name of the first type, if no line names it.
        ros2: Whether the parts of actions have the names of ROS 2.

    """
    found: dict[str, str] = {}
    kind, lines = "MSG", []
    for line in [*text.splitlines(), "MSG: end"]:
        head = _HEAD.fullmatch(line)
        if head is None:
            lines.append("" if line.startswith("====") else line)
            continue
        if name is not None:
            found.update(_parts(kind, name, "\n".join(lines), ros2))
        kind, name, lines = head[1], head[2], []
    return found


def _parts(kind: str, name: str, text: str, ros2: bool) -> dict[str, str]:
    if kind == "MSG":
        return {name: text}
    parts = re.split(r"^---$", text, flags=re.MULTILINE)
    if kind == "SRV":
        request, response = parts
        return {f"{name}Request": request, f"{name}Response": response}
    goal, result, feedback = parts
    if ros2:
        return {
            f"{name}_Goal": goal,
            f"{name}_Result": result,
            f"{name}_Feedback": feedback,
            f"{name}_FeedbackMessage": f"{_GOAL_ID}{name}_Feedback feedback",
        }
    head = _ACTION_HEAD
    return {
        f"{name}Goal": goal,
        f"{name}Result": result,
        f"{name}Feedback": feedback,
        f"{name}ActionGoal": f"{head}GoalID goal_id\n{name}Goal goal",
        f"{name}ActionResult": f"{head}GoalStatus status\n{name}Result result",
        f"{name}ActionFeedback": f"{head}GoalStatus status\n{name}Feedback feedback",
    }


@cache
def _shipped(ros2: bool) -> dict[str, str]:
    own = "ros2.msg" if ros2 else "ros1.msg"
    found: dict[str, str] = {}
    for file in files("webmap.ros").joinpath("msg").iterdir():
        if file.name == own or not file.name.startswith(("ros1.", "ros2.")):
            found.update(split_texts(file.read_text("utf-8"), ros2=ros2))
    return found


@cache
def shipped(ros2: bool) -> Definitions:
    """Return the definitions of one dialect that are included in WebMap."""
    return Definitions(ros2=ros2)


def _named(
    field: Field, among: Sequence[Field], constants: Sequence[Constant]
) -> Field:
    """Return a field with the constants that name its values, if there are any.

    These are the constants that begin with the name of the field. If there are none,
    these are all constants of its type, provided that no other field has that type and
    no constant begins with the name of a field.
    """
    if field.is_array or field.fields is not None:
        return field
    same = {each.name: each.value for each in constants if each.type == field.type}
    prefix = f"{field.name.upper()}_"
    mine = {name: value for name, value in same.items() if name.startswith(prefix)}
    alone = [each.type for each in among].count(field.type) == 1
    others = any(
        name.startswith(f"{each.name.upper()}_") for name in same for each in among
    )
    if not mine and alone and not others:
        mine = same
    return replace(field, constants=mine) if mine else field


def _without_comment(line: str) -> str:
    # A string constant may contain "#"; in any other line it begins a comment.
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
        raise ConfigError(f"{text!r} is not a value of {type}") from None
    if type == "bool":
        return text.strip().lower() in ("true", "1")
    if type in ("string", "wstring"):
        quoted = len(text) > 1 and text[0] == text[-1] and text[0] in "\"'"
        return text[1:-1] if quoted else text
    return None
