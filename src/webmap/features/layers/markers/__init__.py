"""Markers: what ROS programs draw to show what they think.

The layer is in ``layer``, how a marker looks from above in ``shapes`` and ``drawing``.
"""

from webmap.features.layers.markers.layer import Markers

__all__ = ["Markers"]
