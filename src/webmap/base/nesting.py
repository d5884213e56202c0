"""The nesting depth of values from outside."""

from typing import Any

MAX_DEPTH = 32
"""Levels of nested lists and maps; ROS messages have far fewer."""


def is_too_deep(value: Any, allowed: int = MAX_DEPTH) -> bool:
    """Return whether a plain value is nested deeper than ``allowed``."""
    if isinstance(value, dict):
        value = value.values()
    elif not isinstance(value, list):
        return False
    if allowed == 0:
        return True
    return any(
        is_too_deep(item, allowed - 1)
        for item in value
        if isinstance(item, (dict, list))
    )
