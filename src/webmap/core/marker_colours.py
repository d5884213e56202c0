"""The colours of markers, and parts of one colour as one path."""

import math
from collections.abc import Callable, Iterable
from typing import Any

from webmap.ros.messages_marker import ColorMsg, MarkerMsg
from webmap.scene import svg
from webmap.scene.element import Element

SHADES = 16
"""How finely the colours of single points are told apart, from 0 to 1."""


def filled(colour: ColorMsg) -> dict[str, Any]:
    """Return the attributes of an area of a colour."""
    return {"fill": _rgb(colour), "fill_opacity": _alpha(colour)}


def drawn(colour: ColorMsg, width: float) -> dict[str, Any]:
    """Return the attributes of a line of a colour, with its width in metres."""
    return {
        "stroke": _rgb(colour),
        "stroke_opacity": _alpha(colour),
        "stroke_width": width,
        "stroke_linejoin": "round",
    }


def colours(marker: MarkerMsg) -> list[ColorMsg]:
    """Return the colour of each point."""
    return marker.colors or [marker.color] * len(marker.points)


def by_colour(
    parts: Iterable[tuple[str, ColorMsg]],
    style: Callable[[ColorMsg], dict[str, Any]],
) -> Iterable[Element]:
    """Return one path for each colour, whatever their number of parts."""
    paths: dict[tuple[float, ...], list[str]] = {}
    for path, colour in parts:
        key = (_shade(colour.r), _shade(colour.g), _shade(colour.b), _shade(colour.a))
        paths.setdefault(key, []).append(path)
    for shades, together in paths.items():
        colour = ColorMsg(*(part / (SHADES - 1) for part in shades))
        yield svg.path(d="".join(together), **style(colour))


def _shade(part: float) -> int:
    return round(_share(part) * (SHADES - 1))


def _share(part: float) -> float:
    """Return a part of a colour that is one; what is not a number is nothing."""
    return min(1.0, max(0.0, part)) if math.isfinite(part) else 0.0


def _rgb(colour: ColorMsg) -> str:
    parts = (round(255 * _share(part)) for part in (colour.r, colour.g, colour.b))
    return "#" + "".join(f"{part:02x}" for part in parts)


def _alpha(colour: ColorMsg) -> float:
    return round(_share(colour.a), 3)
