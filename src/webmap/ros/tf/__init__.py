"""Frames: where each is in another, at a time.

A :class:`Buffer` takes the transforms of ``/tf`` and ``/tf_static`` and returns those
between any two frames. It knows no sockets, no clocks and no messages.
"""

from webmap.ros.tf.buffer import Buffer, Found
from webmap.ros.tf.transform import (
    FrameMissing,
    NotConnected,
    NotKnownThen,
    Transform,
    TransformError,
)

__all__ = [
    "Buffer",
    "Found",
    "FrameMissing",
    "NotConnected",
    "NotKnownThen",
    "Transform",
    "TransformError",
]
