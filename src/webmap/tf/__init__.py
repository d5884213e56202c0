"""Frames: where each is in another, at a time.

A :class:`Buffer` is told the transforms of ``/tf`` and ``/tf_static`` and asked for
those between any two frames. It knows no sockets, no clocks and no messages.
"""

from webmap.tf.buffer import Buffer
from webmap.tf.errors import FrameMissing, NotConnected, NotKnownThen, TransformError
from webmap.tf.transform import Transform

__all__ = [
    "Buffer",
    "FrameMissing",
    "NotConnected",
    "NotKnownThen",
    "Transform",
    "TransformError",
]
