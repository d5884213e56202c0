"""Compute the places of the dots of a scan without the browser."""

import numpy as np

from webmap.scene.live import Rays


def points_of(rays: Rays) -> np.ndarray:
    """Return the points that rays hit, of shape (N, 2), in metres of the element."""
    reach = np.frombuffer(rays.ranges, "<f4").astype(float)
    chosen = (np.arange(len(reach)) * (rays.total / max(1, len(reach)))).astype(int)
    bearings = rays.first + rays.turn * chosen
    x, y = reach * np.cos(bearings), reach * np.sin(bearings)
    share = chosen / max(1, rays.total)
    cos, sin = np.cos(share * rays.moved[2]), np.sin(share * rays.moved[2])
    x, y = (
        cos * x - sin * y + share * rays.moved[0],
        sin * x + cos * y + share * rays.moved[1],
    )
    a, b, c, d, e, f = rays.place.values
    points = np.column_stack((a * x + c * y + e, b * x + d * y + f))
    return points[np.isfinite(reach)]
