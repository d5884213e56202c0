"""Large messages: in CBOR, or in JSON if they are too large for CBOR. No I/O.

rosbridge for ROS 2 splits what is larger than its parameter ``max_message_size`` (10 MB
unless somebody sets it) into fragments. It does so for JSON; for CBOR it fails, logs an
error and sends nothing. So a large map, which is published once, would never come.
"""

from typing import Literal

from webmap.ros.names import is_type

BULK = (
    "sensor_msgs/LaserScan",
    "nav_msgs/OccupancyGrid",
    "sensor_msgs/PointCloud2",
    "nav_msgs/GridCells",
    "nav_msgs/Path",
    "geometry_msgs/PoseArray",
    "visualization_msgs/Marker",
    "visualization_msgs/MarkerArray",
)
"""Types that come in CBOR unless a listener asks for something else.

A bridge encodes CBOR faster, and only once. JSON that it encodes for longer than the
throttle can hang it when a client leaves: see :func:`webmap.ros.ops.subscribe`.
No type with an array of fixed length is here, since bridges cannot send that as CBOR.
"""

REPLACED = (
    "nav_msgs/OccupancyGrid",
    "sensor_msgs/PointCloud2",
    "sensor_msgs/Image",
    "sensor_msgs/CompressedImage",
)
"""Types above 10 MB at times, of which each message takes the place of the last.

No others are asked for in JSON: with the throttle that this takes, messages would be
lost that count, such as changes of a map.
"""

THROTTLE = 300_000
"""Least milliseconds between two messages that come in JSON in place of CBOR.

A bridge needs 10 s of processor time to encode 16 million cells, and answers everything
else late meanwhile. The throttle has to be longer than that takes, or the bridge can
hang when a client leaves: see :func:`webmap.ros.ops.subscribe`.
"""

PATIENCE = {"cbor": 20.0, "none": 120.0}
"""Seconds for which a bridge may be busy with the first message, by its encoding."""

MOST_LOST = 2
"""Links that may end while a message in JSON is awaited, until none is asked for."""

Answer = Literal["ask", "given up"]


class InJson:
    """Decides whether a topic is asked for in JSON in place of CBOR."""

    def __init__(self) -> None:
        self._state: Literal["cbor", "asked", "json", "not again"] = "cbor"
        self._lost = 0

    @property
    def on(self) -> bool:
        """Whether JSON is to be asked for now."""
        return self._state in ("asked", "json")

    def silent(self, type: str | None, compression: str | None) -> Answer | None:
        """Take in that a published topic stays silent; return what to do, if anything.

        Args:
            type: The type of the topic.
            compression: As what it was asked for.

        """
        if compression != "cbor" or type is None or not is_type(type, *REPLACED):
            return None
        if self._state != "cbor":
            return None
        if self._lost >= MOST_LOST:
            self._state = "not again"
            return "given up"
        self._state = "asked"
        return "ask"

    def received(self, *, in_parts: bool) -> bool | None:
        """Take in a message; return whether it was too large for CBOR.

        None if that is known already, or CBOR was not doubted. A message that came in
        one part was not too large but published late, so CBOR is asked for again, and
        JSON no more on this link.
        """
        if self._state != "asked":
            return None
        self._lost = 0
        self._state = "json" if in_parts else "not again"
        return in_parts

    def begin(self) -> None:
        """Begin anew with CBOR: there is a new link, maybe to a bridge set anew."""
        if self._state == "asked":
            self._lost += 1
        self._state = "cbor"
