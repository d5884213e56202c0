"""The view for each message type, chosen by name or by shape."""

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
"""Views of a pose: with ``place``, ``frame_id`` and ``stamp``."""

# By shape alone, the order matters: types with more fields come first.
ODOMETRY_VIEWS: dict[str, type[OdometryView]] = {
    "nav_msgs/Odometry": messages.OdometryMsg,
    "geometry_msgs/PoseWithCovarianceStamped": messages.PoseWithCovarianceStampedMsg,
    "geometry_msgs/PoseStamped": messages.PoseStampedMsg,
    "geometry_msgs/Pose": messages.PoseMsg,
    "geometry_msgs/Pose2D": messages.Pose2DMsg,
}
"""The views of the types that hold a robot's pose, by the name in ROS 1."""


def odometry_view(type: str) -> type[OdometryView]:
    """Return the view of a type that holds a robot's pose, in either dialect.

    Raises:
        ConfigError: If the type does not hold a robot's pose.

    """
    view = ODOMETRY_VIEWS.get(str(split_type(type)))
    if view is None:
        known = ", ".join(ODOMETRY_VIEWS)
        raise ConfigError(
            f"{type!r} has no pose of a robot; these types have one: {known}"
        )
    return view


def odometry_view_by_shape(message: Mapping[str, Any]) -> type[OdometryView]:
    """Return the view that fits a plain message of unknown type.

    Raises:
        ProtocolError: If the message holds no robot's pose.

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
        f"has no pose of a robot; these types have one: {known}"
    )
