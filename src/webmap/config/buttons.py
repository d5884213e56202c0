"""The configuration of a button: one service call, one message or one parameter."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Annotated, Any, Literal, get_args

from webmap.base.errors import ConfigError
from webmap.config import checks
from webmap.config.checks import KeyPath, Mistakes, expecting
from webmap.config.reading import Config, read
from webmap.ros.definitions import UnknownType
from webmap.ros.message_check import Misfit
from webmap.ros.message_forms import checked, fields_of
from webmap.ros.motion_topics import moved_by_both, moved_by_name, moved_by_type
from webmap.ros.names import normalise_topic, split_type

ButtonKind = Literal["service", "topic", "parameter"]

KINDS: tuple[ButtonKind, ...] = get_args(ButtonKind)

TIMEOUT = 10.0
"""The default time for a service to answer, in seconds."""

LONGEST_TIMEOUT = 3600.0
MAX_LABEL = 60
MAX_BUTTONS = 100

ONLY_OF = {
    "args": ("service",),
    "message": ("topic",),
    "type": ("service", "topic"),
    "node": ("parameter",),
    "value": ("parameter",),
}
"""Keys that not every button has, and the kinds of those that have them."""


def value_kind(value: Any) -> tuple[int, str]:
    """Return the number and the field of ROS 2 for the type of a parameter's value.

    Raises:
        ConfigError: If a parameter cannot have such a value.

    """
    for cls, number, name in (
        (bool, 1, "bool_value"),
        (int, 2, "integer_value"),
        (float, 3, "double_value"),
        (str, 4, "string_value"),
    ):
        if isinstance(value, cls):
            _check_number(value)
            return number, name
    if isinstance(value, list) and value:
        kinds = {value_kind(each)[0] for each in value}
        if kinds <= {1, 2, 3, 4} and (len(kinds) == 1 or kinds == {2, 3}):
            kind = 3 if kinds == {2, 3} else kinds.pop()
            names = {1: "bool", 2: "integer", 3: "double", 4: "string"}
            return kind + 5, f"{names[kind]}_array_value"
    raise ConfigError(
        f"got {value!r}, expected true, false, a number, a text or a list of one kind"
    )


def _check_number(value: Any) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise ConfigError(f"got {value}, expected a finite number")
    if isinstance(value, int) and abs(value) >= 2**63:
        raise ConfigError("expected a whole number that fits in signed 64 bits")


def _label(value: Any) -> str:
    label = checks.text(value).strip()
    if len(value) > MAX_LABEL:
        raise ConfigError(f"at most {MAX_LABEL} characters")
    return label


def _type(value: Any) -> str:
    split_type(value)
    return str(value).strip()


def _confirm(value: Any) -> bool | str:
    if isinstance(value, bool):
        return value
    return checks.text(value).strip()


def _timeout(value: Any) -> float:
    timeout = checks.above_zero("seconds")(value)
    if timeout > LONGEST_TIMEOUT:
        raise ConfigError(f"at most {LONGEST_TIMEOUT:g}")
    return float(timeout)


class ButtonConfig(Config, kw_only=True, frozen=True):
    """What a press of one button sends to the robot, and what it shows."""

    label: Annotated[str, expecting(f"a text of 1 to {MAX_LABEL} characters", _label)]
    service: Annotated[
        str, expecting('the name of a service, such as "/dock"', normalise_topic)
    ] = ""
    topic: Annotated[
        str, expecting('the name of a topic, such as "/horn"', normalise_topic)
    ] = ""
    parameter: Annotated[
        str,
        expecting("a parameter's name", lambda value: checks.text(value).strip()),
    ] = ""
    type: (
        Annotated[
            str,
            expecting('a type, such as "std_srvs/Trigger" or "std_msgs/Bool"', _type),
        ]
        | None
    ) = None
    args: Annotated[dict[str, Any], expecting("a table of fields", checks.table)] = {}
    """The fields of the request; initial values of a form."""
    message: Annotated[
        dict[str, Any], expecting("a table of fields", checks.table)
    ] = {}
    """The fields of the message; initial values of a form."""
    node: (
        Annotated[
            str, expecting('a node, such as "/controller_server"', normalise_topic)
        ]
        | None
    ) = None
    """The node of ROS 2 that has the parameter; None for a parameter of ROS 1."""
    value: Any = None
    """The value of the parameter."""
    confirm: Annotated[bool | str, expecting("true, false or a question", _confirm)] = (
        False
    )
    timeout: Annotated[
        float, expecting(f"seconds above 0, up to {LONGEST_TIMEOUT:g}", _timeout)
    ] = TIMEOUT
    form: bool = False
    """Whether a person fills in the fields first."""
    during_stop: bool = False
    """Whether it also acts while STOP is active."""

    @property
    def kind(self) -> ButtonKind:
        """What it acts on."""
        return next(kind for kind in KINDS if getattr(self, kind))

    @property
    def name(self) -> str:
        """The resolved name of the service or the topic, or the parameter's name."""
        return str(getattr(self, self.kind))

    @property
    def values(self) -> Mapping[str, Any]:
        """The fields of the request or of the message."""
        return self.args or self.message

    @property
    def question(self) -> str | None:
        """The question before it acts; None without a question."""
        asked = f"Run “{self.label}”?" if self.confirm is True else self.confirm
        return asked or None

    def check(self, path: KeyPath, mistakes: Mistakes) -> None:
        """Add mistakes that concern several fields."""
        kinds = [kind for kind in KINDS if getattr(self, kind)]
        if len(kinds) != 1:
            got = " and ".join(kinds) or "none of them"
            message = f"a button has one of service, topic and parameter; got {got}"
            mistakes.add(path, message)
            return
        for key, owners in ONLY_OF.items():
            if self.kind not in owners and getattr(self, key) not in ({}, None):
                message = f'a button with a {self.kind} has no key "{key}"'
                mistakes.add((*path, key), message)
                return
        why = motion_of(self.kind, self.name, self.type)
        if why is not None:
            mistakes.add((*path, self.kind), why)
        elif self.kind == "parameter":
            self._check_value(path, mistakes)
        else:
            self._check_values(path, mistakes)

    def _check_value(self, path: KeyPath, mistakes: Mistakes) -> None:
        if self.value is None:
            message = "a value is needed, also as the start of a form"
            mistakes.add((*path, "value"), message)
            return
        with mistakes.at((*path, "value")):
            value_kind(self.value)
        if self.form and isinstance(self.value, list):
            mistakes.add((*path, "form"), "there is no form for a list of values")

    def _check_values(self, path: KeyPath, mistakes: Mistakes) -> None:
        key = "args" if self.kind == "service" else "message"
        if self.type is None and self.kind == "topic":
            mistakes.add(path, 'the key "type" is missing')
            return
        if self.type is None and self.form:
            mistakes.add((*path, "type"), "a form needs the type of the service")
            return
        try:
            if self.type is not None:
                with suppress(UnknownType):
                    checked(fields_of(self.type), self.values)
            json.dumps(self.values, allow_nan=False, ensure_ascii=False).encode()
        except Misfit as error:
            mistakes.add((*path, key, *error.path.split(".")), error.reason)
        except RecursionError:
            mistakes.add((*path, key), "it is nested too deeply")
        except (TypeError, ValueError) as error:
            mistakes.add((*path, key), f"it cannot be written as JSON: {error}")


def read_buttons(buttons: Iterable[Any]) -> list[ButtonConfig]:
    """Return the configurations of buttons.

    Raises:
        ConfigError: If one is not valid, or two have the same label; the error names
            the button and lists its mistakes.

    """
    found = []
    for number, each in enumerate(buttons):
        mistakes = Mistakes()
        button = read(ButtonConfig, each, (), mistakes)
        label = button and button.label
        mistakes.refuse(f"button {label!r}" if label else f"button number {number}")
        assert button is not None, "a table without a mistake is a button"
        found.append(button)
    mistakes = Mistakes()
    check_labels(found, ("buttons",), mistakes)
    mistakes.refuse("")
    return found


def check_labels(
    buttons: Sequence[ButtonConfig], path: KeyPath, mistakes: Mistakes
) -> None:
    """Add a mistake for each button whose label another one has, and if they are many.

    Args:
        buttons: The buttons.
        path: The path of the list.
        mistakes: The list for every mistake.

    """
    if len(buttons) > MAX_BUTTONS:
        message = f"expected at most {MAX_BUTTONS} buttons, got more"
        mistakes.add((*path, MAX_BUTTONS), message)
    labels: set[str] = set()
    for index, button in enumerate(buttons):
        if button.label in labels:
            message = f'got "{button.label}", expected a label that no other button has'
            mistakes.add((*path, index, "label"), message)
        labels.add(button.label)


def motion_of(kind: ButtonKind, name: str, type: str | None) -> str | None:
    """Return why no button may write something, or None if it may.

    Args:
        kind: The kind of the button.
        name: The resolved name.
        type: The type, if known.

    """
    if kind == "parameter":
        return None
    by_type = None
    if type is not None:
        by_type = moved_by_type(type) or moved_by_both(name, type)
    moved = by_type or moved_by_name(name)
    if moved is None:
        return None
    what = f"{name} of type {type}" if by_type else name
    return (
        f"{what} carries {moved}, which only the gate sends, by driving, by a goal or "
        "by STOP: remove this button"
    )
