"""The view of one map: the transform from world coordinates to pixels."""

import math
from dataclasses import dataclass

from webmap.base.geometry import Affine


@dataclass(frozen=True, slots=True)
class Rect:
    """A rectangle in pixels, with the names of the browser's ``DOMRect``."""

    left: float = 0.0
    top: float = 0.0
    width: float = 0.0
    height: float = 0.0

    @property
    def right(self) -> float:
        """The right edge, in pixels."""
        return self.left + self.width

    @property
    def bottom(self) -> float:
        """The lower edge, in pixels."""
        return self.top + self.height


def initial_view(width: float, height: float) -> Affine:
    """Return the view with the world's origin in the centre, one pixel per metre.

    World y points up and screen y down (REP 103), so the view mirrors.
    """
    return Affine(1.0, 0.0, 0.0, -1.0, width / 2, height / 2)


def apply_operation(
    view: Affine, rect: Rect, operation: str, args: tuple[float, ...]
) -> Affine:
    """Return the view after an operation that is sent to the browser.

    The browser owns the view; this keeps Python's copy correct until the browser
    reports. ``follow`` changes nothing here, as only the browser then moves the view.
    """
    if operation == "translate":
        return Affine.translation(*args) @ view
    if operation == "scale":
        return Affine.scaling(*args) @ view
    if operation == "rotate":
        angle, x, y = args
        return Affine.rotation(-math.radians(angle), x, y) @ view
    if operation == "set":
        return Affine(*args)
    if operation == "fit":
        return fit_view(rect, *args)
    return view


def fit_view(rect: Rect, x0: float, y0: float, x1: float, y1: float) -> Affine:
    """Return the unrotated view in which a rectangle of the world fills the canvas."""
    across, up = max(abs(x1 - x0), 1e-6), max(abs(y1 - y0), 1e-6)
    factor = min(max(rect.width, 1) / across, max(rect.height, 1) / up)
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    return Affine(
        factor,
        0.0,
        0.0,
        -factor,
        rect.width / 2 - factor * x,
        rect.height / 2 + factor * y,
    )
