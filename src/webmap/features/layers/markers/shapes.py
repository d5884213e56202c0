"""Markers as elements, each in its place, as they look from above."""

import math

from webmap.base.errors import ProtocolError
from webmap.base.geometry import Affine, Pose, Quaternion
from webmap.features.layers.markers import messages as kinds
from webmap.features.layers.markers.drawing import CLASSES, LETTERS, draw, sizes
from webmap.features.layers.markers.messages import MarkerMsg
from webmap.modules.drawing import check_finite, flat, in_space
from webmap.ros.messages import PoseMsg, QuaternionMsg
from webmap.ros.tf import Transform
from webmap.scene import svg
from webmap.scene.element import Element

MAX_POINTS = 20_000
"""The most points that one marker may have."""

SEEN = 3
"""Decimals of a rotation up to which a marker is drawn anew as it tilts."""

UNTURNED = QuaternionMsg(0.0, 0.0, 0.0, 1.0)

AS_IT_COMES = Transform()
"""The frame of a marker that is drawn with its own numbers."""


def lies_unturned(marker: MarkerMsg) -> bool:
    """Return whether nobody has set a marker's orientation, so that it is not turned.

    A quaternion of exact zeros is how ROS 1 begins a message, and RViz draws it so.
    What is merely too short to be a rotation was worked out by somebody, and wrongly.
    """
    q = marker.pose.orientation
    return marker.type != kinds.TEXT_VIEW_FACING and q.x == q.y == q.z == q.w == 0.0


def shape_of(marker: MarkerMsg, frame: Transform = AS_IT_COMES) -> Element:
    """Return a marker as a group in its place, seen from above.

    Args:
        marker: The marker.
        frame: As :func:`place` has it.

    Raises:
        ProtocolError: If its type cannot be drawn, or a number makes no sense.

    """
    name = CLASSES.get(marker.type)
    if name is None:
        raise ProtocolError(f"markers of type {marker.type} are not drawn")
    if len(marker.points) > MAX_POINTS:
        raise ProtocolError(
            f"it has {len(marker.points)} points; {MAX_POINTS} are the limit"
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
    """Return what a marker's shape depends on, but for its place.

    Args:
        marker: The marker.
        frame: As :func:`place` has it.

    Raises:
        ProtocolError: If its pose makes no sense.

    """
    m = marker
    q = _split(m, frame)[1].rotation
    sign = math.copysign(1.0, q.w)  # both signs are one rotation
    tilt = (round(sign * part, SEEN) + 0.0 for part in (q.x, q.y, q.z, q.w))
    return (m.type, m.scale, m.color, m.points, m.colors, m.text, *tilt)


def place(shape: Element, marker: MarkerMsg, frame: Transform = AS_IT_COMES) -> None:
    """Put a shape where the marker has it, as it was drawn.

    Args:
        shape: The shape.
        marker: Its marker.
        frame: What takes coordinates of the marker's frame to those of the map.

    Raises:
        ProtocolError: If its pose makes no sense.

    """
    at, _ = _split(marker, frame)
    if marker.type == kinds.TEXT_VIEW_FACING:
        # The world has y upward; letters have it downward.
        size = sizes(marker, "z")[0] / LETTERS
        shape.set_matrix(Affine(size, 0, 0, -size, at.x, at.y))
    else:
        shape.set_pose(at.x, at.y, at.yaw)


def _split(marker: MarkerMsg, frame: Transform) -> tuple[Pose, Transform]:
    """Return where a marker is in the plane, and how it is tilted there."""
    if marker.type == kinds.TEXT_VIEW_FACING:
        # Its orientation means nothing, and often nobody has set it.
        at = marker.pose.position
        check_finite([(at.x, at.y)], "the place of a text")
        (found,) = flat(in_space([at]), frame)
        return Pose(*found), Transform()
    (place,) = in_space([marker.pose.position])
    orientation = UNTURNED if lies_unturned(marker) else marker.pose.orientation
    _ = PoseMsg(marker.pose.position, orientation).usable
    q = orientation.quaternion
    n = q.norm
    turn = Quaternion(q.x / n, q.y / n, q.z / n, q.w / n)
    pose, tilt = (frame @ Transform(place, turn)).heading_and_tilt
    return pose, Transform(rotation=tilt.rotation)
