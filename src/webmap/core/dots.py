"""Points as the dots of a path: two numbers of 16 bits each."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

UNIT = 0.001
"""Metres per unit, as long as all points fit in 16 bits."""

MOST = 32767
"""Units that a number of 16 bits holds."""


def in_units(points: "NDArray[np.float64]") -> "tuple[NDArray[np.int16], float]":
    """Return points in whole units, and how many metres a unit is.

    Args:
        points: Of shape (N, 2), in metres.

    Returns:
        Little-endian numbers of the same shape; their bytes and the unit are what
        :meth:`webmap.Element.set_dots` takes.

    """
    farthest = float(abs(points).max()) if len(points) else 0.0
    unit = max(UNIT, farthest / MOST)
    return (points / unit).round().astype("<i2"), unit
