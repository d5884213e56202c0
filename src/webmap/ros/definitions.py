"""The catalogue of message and service definitions, and the reader of their texts.

The texts are in the language of ``.msg``, ``.srv`` and ``.action`` files of ROS 1 and
ROS 2. One text holds many types, as in bags and in the answers of bridges: a line such
as ``MSG: std_msgs/Bool``, ``SRV: std_srvs/SetBool`` or ``ACTION: my_msgs/Dock``
begins each type. WebMap ships those in ``msg/``, one file for each package; the files
``ros1.msg`` and ``ros2.msg`` hold the types whose fields differ between the two.

Names are written as in ROS 1: ``std_msgs/Bool``. The request of a service is
``std_srvs/SetBoolRequest``, its response ``std_srvs/SetBoolResponse``. The messages of
an action have the names that the dialect gives them.
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
"""The range of each type of whole numbers."""

FLOATS = {"float32": 3.4028234663852886e38, "float64": 1.7976931348623157e308}
"""The largest number of each type."""

OCTETS = ("uint8", "byte", "char")
"""The types of one byte, whose arrays are bytes."""

TIMES = ("time", "duration")
"""The types of a moment and of a length of time, under these names in both dialects."""

SCALARS = (*INTEGERS, *FLOATS, *TIMES, "bool", "string")
"""The types that hold no fields."""

MAX_DEPTH = 16
"""How deep messages are nested."""

_OTHER_NAMES = {
    "builtin_interfaces/Time": "time",
    "builtin_interfaces/Duration": "duration",
    "wstring": "string",
    "Header": "std_msgs/Header",
}
_HEAD = re.compile(r"(MSG|SRV|ACTION):\s*(\S+)\s*")
_LINE = re.compile(
    r"(?P<type>[A-Za-z][A-Za-z0-9_/]*)"
    r"(?:<=(?P<longest>[0-9]+))?"
    r"(?P<array>\[(?P<bound><=)?(?P<size>[0-9]*)\])?"
    r"\s+(?P<name>[A-Za-z][A-Za-z0-9_]*)\s*(?P<rest>.*)"
)
_GOAL_ID = "unique_identifier_msgs/UUID goal_id\n"
_ACTION_HEAD = "std_msgs/Header header\nactionlib_msgs/"


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
    """Those of a message; None for a scalar."""

    is_array: bool = False
    size: int | None = None
    """Elements of an array of fixed size."""

    most: int | None = None
    """The most elements of a bounded array."""

    longest: int | None = None
    """Characters that a text may have; None if nothing bounds it."""

    default: Any = None
    """What ROS takes if it is left out; None for zero, false or an empty text."""

    constants: Mapping[str, Any] | None = None
    """Names for its values."""


@dataclass(frozen=True, slots=True)
class Constant:
    """A name for a value that stands in a definition."""

    name: str
    type: str
    value: Any


@dataclass(frozen=True, slots=True)
class Definition:
    """One message type: what it is made of."""

    name: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...] = ()


class Definitions:
    """The definitions of types, found by name.

    Args:
        ros2: Whether they are those of ROS 2.
        texts: Texts by the names of types, which count more than the shipped ones.

    """

    def __init__(self, texts: Mapping[str, str] | None = None, *, ros2: bool) -> None:
        self.ros2 = ros2
        self._texts = {**_shipped(ros2), **(texts or {})}
        self._read: dict[str, Definition] = {}

    def __contains__(self, name: str) -> bool:
        return name in self._texts

    def __iter__(self) -> Iterator[str]:
        return iter(self._texts)

    def text(self, name: str) -> str:
        """Return the text of one type alone, by its name as ROS 1 writes it."""
        return self._texts[name]

    def definition(self, type: str) -> Definition:
        """Return the definition of a message, or of the request of a service.

        Args:
            type: In either dialect.

        Raises:
            UnknownType: If a definition is missing, of the type or of a part of it.
            ConfigError: If a definition makes no sense.

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
            if "/" not in kind:  # of the same package
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
    """Return the text of each type that stands in one text, by the types' names.

    Args:
        text: Types one after the other.
        name: Of the message that the text begins with, if no line tells it.
        ros2: Whether the parts of actions are named as in ROS 2.

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
    """Return the definitions that WebMap brings along, for one dialect."""
    return Definitions(ros2=ros2)


def _named(
    field: Field, among: Sequence[Field], constants: Sequence[Constant]
) -> Field:
    """Give a field the constants that are names for its values, if there are any.

    Those whose names begin with its own are; or all of its type, if no other field
    has that type and none of them is called like a field.
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
