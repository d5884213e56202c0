"""The configuration of a button: one service call, one message or one parameter."""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from webmap.base.errors import ConfigError
from webmap.config.checks import KeyPath, Mistakes, did_you_mean
from webmap.ros.definitions import UnknownType
from webmap.ros.message_check import Misfit
from webmap.ros.message_forms import checked, fields_of
from webmap.ros.motion_topics import moved_by_both, moved_by_name, moved_by_type
from webmap.ros.names import normalise_topic, split_type

ButtonKind = Literal["service", "topic", "parameter"]

TIMEOUT = 10.0
"""The default time for a service to answer, in seconds."""

LONGEST_TIMEOUT = 3600.0
MAX_LABEL = 60
MAX_BUTTONS = 100

_COMMON = ("label", "confirm", "timeout", "form", "during_stop")
_KEYS: dict[ButtonKind, tuple[str, ...]] = {
    "service": (*_COMMON, "service", "type", "args"),
    "topic": (*_COMMON, "topic", "type", "message"),
    "parameter": (*_COMMON, "parameter", "node", "value"),
}


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


class ButtonMistake(ConfigError):
    """A mistake in a button's configuration.

    Attributes:
        key: The key; empty if it is about the button as a whole.
        message: The mistake.

    """

    def __init__(self, key: str, message: str) -> None:
        super().__init__(f"{key}: {message}" if key else message)
        self.key = key
        self.message = message


@dataclass(frozen=True, slots=True)
class ButtonSpec:
    """What a press of one button sends to the robot, and what it shows."""

    label: str
    kind: ButtonKind
    name: str
    """The resolved name of the service or the topic, or the parameter's name."""

    type: str | None = None
    values: Mapping[str, Any] = field(default_factory=dict)
    """The fields of the request or of the message; initial values of a form."""

    node: str | None = None
    """The node of ROS 2 that has the parameter; None for a parameter of ROS 1."""

    value: Any = None
    """The value of the parameter."""

    confirm: str | None = None
    """The question before it acts; None without a question."""

    timeout: float = TIMEOUT
    form: bool = False
    """Whether a person fills in the fields first."""

    during_stop: bool = False
    """Whether it also acts while STOP is active."""


def read_buttons(data: Iterable[Mapping[str, Any]]) -> list[ButtonSpec]:
    """Return the actions of buttons.

    Raises:
        ConfigError: If one is not valid, or two have the same label.

    """
    specs: list[ButtonSpec] = []
    for number, each in enumerate(data):
        if len(specs) == MAX_BUTTONS:
            raise ConfigError(f"expected at most {MAX_BUTTONS} buttons, got more")
        try:
            spec = read_button(each)
        except ButtonMistake as error:
            label = each.get("label") if isinstance(each, Mapping) else None
            of = f"{label!r}" if isinstance(label, str) else f"number {number}"
            raise ConfigError(f"button {of}: {error}") from None
        if any(spec.label == other.label for other in specs):
            raise ConfigError(f"two buttons have the label {spec.label!r}")
        specs.append(spec)
    return specs


def check_buttons(buttons: Iterable[Any], path: KeyPath, mistakes: Mistakes) -> None:
    """Add all mistakes in buttons.

    Args:
        buttons: A table for each.
        path: The path of the list.
        mistakes: The list for every mistake.

    """
    first: dict[str, int] = {}
    for index, each in enumerate(buttons):
        try:
            label = read_button(each).label
        except ButtonMistake as error:
            key = tuple(part for part in error.key.split(".") if part)
            mistakes.add((*path, index, *key), error.message)
            continue
        if first.setdefault(label, index) != index:
            message = f'got "{label}", expected a label that no other button has'
            mistakes.add((*path, index, "label"), message)


def read_button(data: Mapping[str, Any]) -> ButtonSpec:
    """Return the action of one button.

    Raises:
        ButtonMistake: If it is not valid, or would move a robot.

    """
    if not isinstance(data, Mapping):
        raise ButtonMistake("", f"got {data!r}, expected a table of keys and values")
    kinds: list[ButtonKind] = [kind for kind in _KEYS if kind in data]
    if len(kinds) != 1:
        got = " and ".join(kinds) or "none of them"
        raise ButtonMistake(
            "", f"a button has one of service, topic and parameter; got {got}"
        )
    kind = kinds[0]
    for key in data:
        if key not in _KEYS[kind]:
            hint = did_you_mean(key, _KEYS[kind])
            listed = ", ".join(_KEYS[kind])
            raise ButtonMistake(str(key), f"no such key{hint}; there are {listed}")
    form = _flag(data, "form")
    spec = ButtonSpec(
        label=_label(data),
        kind=kind,
        name=_name(data, kind),
        type=_type(data, kind),
        values=_table(data, "args" if kind == "service" else "message"),
        node=_node(data),
        value=data.get("value"),
        confirm=_confirm(data),
        timeout=_timeout(data),
        form=form,
        during_stop=_flag(data, "during_stop"),
    )
    why = motion_of(spec.kind, spec.name, spec.type)
    if why is not None:
        raise ButtonMistake(kind, why)
    if kind == "parameter":
        _check_value(spec)
    else:
        _check_values(spec)
    return spec


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


def _label(data: Mapping[str, Any]) -> str:
    label = data.get("label")
    if not isinstance(label, str) or not label.strip() or len(label) > MAX_LABEL:
        raise ButtonMistake(
            "label", f"got {label!r}, expected a text of 1 to {MAX_LABEL} characters"
        )
    return label.strip()


def _name(data: Mapping[str, Any], kind: ButtonKind) -> str:
    name = data[kind]
    if kind == "parameter":
        if not isinstance(name, str) or not name.strip():
            raise ButtonMistake(kind, f"got {name!r}, expected a parameter's name")
        return name.strip()
    try:
        return normalise_topic(name)
    except ConfigError:
        what = "service" if kind == "service" else "topic"
        raise ButtonMistake(
            kind, f'got {name!r}, expected the name of a {what}, such as "/dock"'
        ) from None


def _type(data: Mapping[str, Any], kind: ButtonKind) -> str | None:
    type = data.get("type")
    if type is None and kind != "topic":
        return None
    try:
        split_type(type)  # type: ignore[arg-type]  # refuses values that are not text
    except ConfigError:
        example = "std_msgs/Bool" if kind == "topic" else "std_srvs/Trigger"
        raise ButtonMistake(
            "type", f'got {type!r}, expected a type, such as "{example}"'
        ) from None
    return str(type).strip()


def _table(data: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    table = data.get(key, {})
    if not isinstance(table, Mapping):
        raise ButtonMistake(key, f"got {table!r}, expected a table of fields")
    return dict(table)


def _node(data: Mapping[str, Any]) -> str | None:
    node = data.get("node")
    if node is None:
        return None
    try:
        return normalise_topic(node)
    except ConfigError:
        raise ButtonMistake(
            "node", f'got {node!r}, expected a node, such as "/controller_server"'
        ) from None


def _confirm(data: Mapping[str, Any]) -> str | None:
    confirm = data.get("confirm", False)
    if isinstance(confirm, str) and confirm.strip():
        return confirm.strip()
    if not isinstance(confirm, bool):
        raise ButtonMistake(
            "confirm", f"got {confirm!r}, expected true, false or a question"
        )
    return f"Run “{_label(data)}”?" if confirm else None


def _timeout(data: Mapping[str, Any]) -> float:
    timeout = data.get("timeout", TIMEOUT)
    number = isinstance(timeout, int | float) and not isinstance(timeout, bool)
    if not number or not 0 < timeout <= LONGEST_TIMEOUT:
        raise ButtonMistake(
            "timeout",
            f"got {timeout!r}, expected seconds above 0, up to {LONGEST_TIMEOUT:g}",
        )
    return float(timeout)


def _flag(data: Mapping[str, Any], key: str) -> bool:
    flag = data.get(key, False)
    if not isinstance(flag, bool):
        raise ButtonMistake(key, f"got {flag!r}, expected true or false")
    return flag


def _check_values(spec: ButtonSpec) -> None:
    key = "args" if spec.kind == "service" else "message"
    if spec.type is None:
        if spec.form:
            raise ButtonMistake("type", "a form needs the type of the service")
        fields = None
    else:
        try:
            fields = fields_of(spec.type)
        except UnknownType:
            fields = None
    try:
        if fields is not None:
            checked(fields, spec.values)
        json.dumps(spec.values, allow_nan=False, ensure_ascii=False).encode()
    except Misfit as error:
        raise ButtonMistake(f"{key}.{error.path}", error.reason) from None
    except RecursionError:
        raise ButtonMistake(key, "it is nested too deeply") from None
    except (TypeError, ValueError) as error:
        raise ButtonMistake(key, f"it cannot be written as JSON: {error}") from None


def _check_value(spec: ButtonSpec) -> None:
    if spec.value is None:
        raise ButtonMistake("value", "a value is needed, also as the start of a form")
    try:
        value_kind(spec.value)
    except ConfigError as error:
        raise ButtonMistake("value", str(error)) from None
    if spec.form and isinstance(spec.value, list):
        raise ButtonMistake("form", "there is no form for a list of values")
