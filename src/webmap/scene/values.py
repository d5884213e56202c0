"""Attribute values as text."""

import math
from collections.abc import Iterable
from typing import Any

from webmap.errors import SceneError
from webmap.scene.allowed import BOOLEAN_ATTRIBUTES


def format_number(value: float) -> str:
    """Return ``value`` as short as SVG allows, to nine significant digits.

    Raises:
        SceneError: If ``value`` is NaN or infinite.

    """
    if not math.isfinite(value):
        raise SceneError(f"a number in a scene must be finite, got {value}")
    return f"{value:.9g}" if value else "0"


def format_value(name: str, value: Any) -> str | None:
    """Return the text of an attribute, or None if it is to be absent.

    Numbers become short text, True an attribute without a value (``"true"`` for
    ``aria-*`` and ``data-*``), None and False no attribute, and sequences what
    ``points`` and ``viewBox`` want: items apart by spaces, pairs by commas.

    Raises:
        SceneError: If ``value`` has a number that is not finite, or no text.

    """
    if isinstance(value, str):
        return value
    if value is None:
        return None
    if isinstance(value, bool):
        return _format_bool(name, value)
    if isinstance(value, Iterable) and not isinstance(value, bytes | dict):
        return " ".join(_format_item(name, item) for item in value)
    if hasattr(value, "__float__"):
        return format_number(float(value))
    raise SceneError(f"{name}: cannot make an attribute of {value!r}")


def _format_bool(name: str, value: bool) -> str | None:
    if name in BOOLEAN_ATTRIBUTES:
        return "" if value else None
    return "true" if value else "false"


def _format_item(name: str, item: Any) -> str:
    if isinstance(item, Iterable) and not isinstance(item, str):
        return ",".join(_format_item(name, part) for part in item)
    text = format_value(name, item)
    if text is None:
        raise SceneError(f"{name}: a sequence cannot hold {item!r}")
    return text
