"""Size limits of messages by type, in one table, and their checks.

A message of one robot must not delay the data of other robots. So the bytes of a
message are checked when it comes, and its values are counted before any of them is
built.
"""

from collections.abc import Iterable
from typing import NamedTuple

from webmap.base.errors import ProtocolError
from webmap.ros.names import split_type

MIB = 1 << 20

MAX_FRAME = 64 * MIB
"""Most bytes of a WebSocket message; of a longer one only the topic is read."""

LARGE = 256 << 10
"""Bytes above which the worker process decodes a frame."""

MAX_VALUES = 100_000
"""Most objects and lists in one message."""


class TooLarge(ProtocolError):
    """A message is larger than its type may be."""


class Limit(NamedTuple):
    """Size limit of the messages of a type, with its reason."""

    size: int
    """Bytes of the whole frame, as received."""

    why: str
    """The reason for the limit."""

    advice: str
    """What a person can do about a larger message."""


GENERAL = Limit(
    4 * MIB,
    "room for 10,000 poses, transforms or markers, which is more than a page can show",
    "publish less at a time, or on several topics",
)

_GRID = Limit(
    64 * MIB,
    "a map of 64 million cells has this size in a binary encoding",
    "publish a coarser map, or a part of it",
)

LIMITS: dict[str, Limit] = {
    "nav_msgs/OccupancyGrid": _GRID,
    "map_msgs/OccupancyGridUpdate": _GRID,
    "sensor_msgs/PointCloud2": Limit(
        64 * MIB,
        "a cloud of 4 million points of 16 bytes has this size in a binary encoding",
        "thin the cloud on the robot, for instance with a voxel filter",
    ),
    "sensor_msgs/Image": Limit(
        64 * MIB,
        "a picture of 16 million pixels in three colours has 48 MiB",
        "publish a smaller picture, or a compressed one",
    ),
    "sensor_msgs/CompressedImage": Limit(
        8 * MIB,
        "a picture of 4 MiB has 6 MiB as text, which writes it in base64",
        "publish a smaller picture, or compress it more",
    ),
}
"""The types, by the name in ROS 1, that may be larger than :data:`GENERAL`."""

ITEMS = {
    "transforms": (10_000, "4,096 frames are kept"),
    "poses": (20_000, "500 of them are drawn"),
    "particles": (20_000, "500 of them are drawn"),
    "markers": (10_000, "5,000 of them are drawn"),
    "corners": (10_000, "so many corners of a polygon are drawn"),
    "status": (2_000, "1,000 parts of a robot are shown"),
}
"""Most items of one list of a message, with the reason, by the name of the field."""

_VIEWS = {"ShownAnyImageMsg": "sensor_msgs/Image"}
"""The types of views that may be used when no type is stated."""


def limit_of(type: str | None, views: Iterable[object] = ()) -> Limit:
    """Return the limit of a topic.

    Args:
        type: The message type, in either dialect; None if not stated.
        views: The types that the message is decoded as; they show the type if it is not
            stated.

    """
    if type is None:
        names = (_VIEWS.get(getattr(view, "__name__", "")) for view in views)
        type = next((name for name in names if name), None)
    return GENERAL if type is None else LIMITS.get(str(split_type(type)), GENERAL)


def check_size(size: int, limit: Limit, type: str | None) -> None:
    """Check the size of a message against the limit of its type.

    Args:
        size: Bytes of the frame.
        limit: The limit of its topic.
        type: The message type; None if not stated.

    Raises:
        TooLarge: If the message is larger; the error message gives advice.

    """
    if size > limit.size:
        raise TooLarge(
            f"got a message of {size / MIB:.1f} MiB; {type or 'this topic'} may have "
            f"{limit.size // MIB} MiB: {limit.advice}"
        )


def check_items(field: str, count: int) -> None:
    """Check the length of a list against :data:`ITEMS`.

    Args:
        field: The field's name.
        count: Number of items in the list.

    Raises:
        TooLarge: If there are more than :data:`ITEMS` allows.

    """
    most, _ = ITEMS.get(field, (MAX_VALUES, ""))
    if count > most:
        raise TooLarge(
            f"got a message with {count} {field}; the limit is {most}: {GENERAL.advice}"
        )
