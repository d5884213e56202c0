"""Typed views of marker messages."""

from typing import ClassVar

import msgspec

from webmap.ros.messages import Header, PointMsg, PoseMsg, Stamped, Time

ARROW, CUBE, SPHERE, CYLINDER, LINE_STRIP, LINE_LIST = range(6)
CUBE_LIST, SPHERE_LIST, POINTS, TEXT_VIEW_FACING, MESH_RESOURCE, TRIANGLE_LIST = range(
    6, 12
)

ADD, DELETE, DELETE_ALL = 0, 2, 3


class ColorMsg(msgspec.Struct, frozen=True, gc=False):
    """``std_msgs/ColorRGBA``; each component from 0 to 1."""

    r: float
    g: float
    b: float
    a: float = 1.0


class MarkerHeader(Header, frozen=True, gc=False):
    """The header of a marker."""

    seq: int | None = None
    """The number of the message; only ROS 1 has one."""


class MarkerMsg(Stamped, frozen=True, kw_only=True):
    """``visualization_msgs/Marker``."""

    header: MarkerHeader = MarkerHeader()
    type: int
    action: int
    pose: PoseMsg
    scale: PointMsg
    """In metres; the meaning of each depends on the type."""

    color: ColorMsg
    ns: str = ""
    id: int = 0
    lifetime: Time = Time()
    """Time for which the marker is shown; 0 for ever."""

    points: list[PointMsg] = msgspec.field(default_factory=list)
    """In the frame of :attr:`pose`."""

    colors: list[ColorMsg] = msgspec.field(default_factory=list)
    """One for each point, or none."""

    text: str = ""
    frame_locked: bool = False
    """Whether the marker moves with its frame."""

    def clears(self, ns: str) -> bool:
        """Return whether the action :data:`DELETE_ALL` deletes markers of a namespace.

        In ROS 2, a namespace limits it to the markers of this namespace. ROS 1 deletes
        all markers of the topic, whatever the namespace.
        """
        return self.ns in ("", ns) or self.header.seq is not None


class MarkerArrayMsg(msgspec.Struct, frozen=True):
    """``visualization_msgs/MarkerArray``."""

    separable: ClassVar = True
    markers: list[MarkerMsg]
