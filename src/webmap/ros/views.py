"""Which view belongs to which message type, told by name or by shape."""

from collections.abc import Mapping
from typing import Any, TypeAlias

from webmap.base.errors import ConfigError, ProtocolError
from webmap.ros import messages
from webmap.ros.decoding import convert
from webmap.ros.names import split_type

OdometryView: TypeAlias = (
    messages.OdometryMsg
    | messages.PoseWithCovarianceStampedMsg
    | messages.PoseStampedMsg
    | messages.PoseMsg
    | messages.Pose2DMsg
)
"""Views that say where something is: with ``place``, ``frame_id`` and ``stamp``."""

# The order matters where a shape is all there is: fuller types come first.
ODOMETRY_VIEWS: dict[str, type[OdometryView]] = {
    "nav_msgs/Odometry": messages.OdometryMsg,
    "geometry_msgs/PoseWithCovarianceStamped": messages.PoseWithCovarianceStampedMsg,
    "geometry_msgs/PoseStamped": messages.PoseStampedMsg,
    "geometry_msgs/Pose": messages.PoseMsg,
    "geometry_msgs/Pose2D": messages.Pose2DMsg,
}
"""The views of the types that say where a robot is, by the name in ROS 1."""


def odometry_view(type: str) -> type[OdometryView]:
    """Return the view of a type that says where a robot is, in either dialect.

    Raises:
        ConfigError: If it is not such a type.

    """
    view = ODOMETRY_VIEWS.get(str(split_type(type)))
    if view is None:
        known = ", ".join(ODOMETRY_VIEWS)
        raise ConfigError(f"{type!r} does not say where a robot is; these do: {known}")
    return view


def odometry_view_by_shape(message: Mapping[str, Any]) -> type[OdometryView]:
    """Return the view that a plain message fits, when nobody knows its type.

    Raises:
        ProtocolError: If it says nowhere where a robot is.

    """
    for view in ODOMETRY_VIEWS.values():
        try:
            convert(message, view)
        except ProtocolError:
            continue
        return view
    known = ", ".join(ODOMETRY_VIEWS)
    raise ProtocolError(
        f"a message with the fields {', '.join(sorted(message))} "
        f"says nowhere where a robot is; these types do: {known}"
    )
