"""Frames (``tf``): the transform between two frames at a time.

A :class:`Buffer` takes the transforms of ``/tf`` and ``/tf_static`` and returns those
between any two frames. It does no I/O and asks no clock. Open ``buffer`` first.
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
