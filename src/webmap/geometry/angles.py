"""Angles."""

import math


def normalize_angle(angle: float) -> float:
    """Return the same direction as ``angle`` in ``[-pi, pi]``, in radians.

    Raises:
        ValueError: If ``angle`` is infinite.

    """
    return math.remainder(angle, math.tau)
