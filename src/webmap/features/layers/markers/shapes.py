"""Markers as elements at their poses, seen from above."""

import math

from webmap.base.errors import ProtocolError
from webmap.base.geometry import Affine, Pose, Quaternion
from webmap.features.layers.markers import messages as kinds
from webmap.features.layers.markers.drawing import CLASSES, LETTERS, draw, sizes
from webmap.features.layers.markers.messages import MarkerMsg
from webmap.modules.drawing import check_finite, flat, in_space
from webmap.ros.tf import Transform
from webmap.scene import svg
from webmap.scene.element import Element

MAX_POINTS = 20_000
"""Greatest number of points of one marker."""

SEEN = 3
"""Decimals of a rotation that decide whether a tilting marker is drawn again."""

AS_IT_COMES = Transform()
"""The identity: draws a marker with its own coordinates."""


def shape_of(marker: MarkerMsg, frame: Transform = AS_IT_COMES) -> Element:
    """Return a marker as a group at its pose, seen from above.

    Args:
        marker: The marker.
        frame: See :func:`place`.

    Raises:
        ProtocolError: If its type cannot be drawn, or a number is not valid.
    """
    name = CLASSES.get(marker.type)
    if name is None:
        raise ProtocolError(f"markers of type {marker.type} are not drawn")
    if len(marker.points) > MAX_POINTS:
        raise ProtocolError(
            f"it has {len(marker.points)} points; the limit is {MAX_POINTS}"
        )
    if marker.colors and len(marker.colors) != len(marker.points):
        raise ProtocolError(
            f"it has {len(marker.colors)} colours for {len(marker.points)} points"
        )
    group = svg.g(class_=f"marker {name}")
    place(group, marker, frame)
    group.append(*draw(marker, _split(marker, frame)[1]))
    return group


def look_of(marker: MarkerMsg, frame: Transform = AS_IT_COMES) -> tuple[object, ...]:
    """Return all values that a marker's shape depends on, except its position.

    Args:
        marker: The marker.
        frame: See :func:`place`.

    Raises:
        ProtocolError: If its pose is not valid.
    """
    m = marker
    q = _split(m, frame)[1].rotation
    sign = math.copysign(1.0, q.w)  # both signs are the same rotation
    tilt = (round(sign * part, SEEN) + 0.0 for part in (q.x, q.y, q.z, q.w))
    return (m.type, m.scale, m.color, m.points, m.colors, m.text, *tilt)


def place(shape: Element, marker: MarkerMsg, frame: Transform = AS_IT_COMES) -> None:
    """Place an already drawn shape at its marker's pose.

    Args:
        shape: The shape.
        marker: The shape's marker.
        frame: The transform from the marker's frame to the map.

    Raises:
        ProtocolError: If its pose is not valid.
    """
    at, _ = _split(marker, frame)
    if marker.type == kinds.TEXT_VIEW_FACING:
        # y points up in the world, and down in letters.
        size = sizes(marker, "z")[0] / LETTERS
        shape.set_matrix(Affine(size, 0, 0, -size, at.x, at.y))
    else:
        shape.set_pose(at.x, at.y, at.yaw)


def _split(marker: MarkerMsg, frame: Transform) -> tuple[Pose, Transform]:
    """Return the marker's pose in the plane, and its tilt there."""
    if marker.type == kinds.TEXT_VIEW_FACING:
        # The orientation of this type has no meaning, and is often not set.
        at = marker.pose.position
        check_finite([(at.x, at.y)], "the place of a text")
        (found,) = flat(in_space([at]), frame)
        return Pose(*found), Transform()
    (place,) = in_space([marker.pose.position])
    _ = marker.pose.usable
    q = marker.pose.orientation.quaternion
    n = q.norm
    turn = Quaternion(q.x / n, q.y / n, q.z / n, q.w / n)
    pose, tilt = (frame @ Transform(place, turn)).heading_and_tilt
    return pose, Transform(rotation=tilt.rotation)
