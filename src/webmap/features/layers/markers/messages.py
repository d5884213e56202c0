"""Typed views of marker messages."""

from typing import ClassVar

import msgspec

from webmap.ros.messages import PointMsg, PoseMsg, Stamped, Time

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


class MarkerMsg(Stamped, frozen=True, kw_only=True):
    """``visualization_msgs/Marker``."""

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


class MarkerArrayMsg(msgspec.Struct, frozen=True):
    """``visualization_msgs/MarkerArray``."""

    separable: ClassVar = True
    markers: list[MarkerMsg]
