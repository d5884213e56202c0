"""Topics that say what they have to say once, for those too who come later."""

from typing import Any

NAMES = ("map", "tf_static", "robot_description")
"""What such topics are called, whatever a bag tells of them."""

TYPES = ("nav_msgs/OccupancyGrid",)
"""What is worth keeping of any topic: it is large, and seldom comes."""

STATIC = "tf_static"


def is_latched(topic: str, type_name: str) -> bool:
    """Return whether the newest message of a topic is kept by its name or type.

    Args:
        topic: Its name.
        type_name: Canonical, such as ``nav_msgs/OccupancyGrid``.

    """
    return topic.rpartition("/")[2] in NAMES or type_name in TYPES


def is_static(topic: str) -> bool:
    """Return whether a topic tells of frames that never move against each other."""
    return topic.rpartition("/")[2] == STATIC


class StaticFrames:
    """All that was told of static frames, as one message.

    Each node tells of its own, and a bag does not say which node said what; so the
    newest message alone would leave the others' out.
    """

    def __init__(self) -> None:
        self._frames: dict[str, Any] = {}

    def with_all(self, message: dict[str, Any]) -> dict[str, Any]:
        """Return a ``tf2_msgs/TFMessage`` with what was told before it."""
        for transform in message["transforms"]:
            self._frames[transform["child_frame_id"]] = transform
        return {"transforms": list(self._frames.values())}
