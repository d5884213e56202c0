"""What the parameter of a node can be, and how ROS 2 calls each kind of value."""

import math
from typing import Any

from webmap.errors import ConfigError


def value_kind(value: Any) -> tuple[int, str]:
    """Return how ROS 2 calls the kind of a parameter's value: number and field.

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
        raise ConfigError("a whole number has 64 bits")
