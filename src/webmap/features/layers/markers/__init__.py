"""Markers: shapes that ROS programs publish for people.

The layer is in ``layer``; ``shapes`` and ``drawing`` define how a marker looks from
above.
"""

from webmap.features.layers.markers.layer import Markers

__all__ = ["Markers"]
