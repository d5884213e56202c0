"""Bags for tests, written with the modules of the recorder."""

from functools import cache

from webmap.bags.recorder import new_bag
from webmap.bags.types import Types
from webmap.ros.rosbridge.server.dialect import Dialect
from webmap.ros.rosbridge.server.schema import Schema

BEGIN = 1_700_000_000 * 10**9
"""The time of the begin of each bag, in nanoseconds since 1970."""

ODOMETRY = "nav_msgs/Odometry"
TWIST = "geometry_msgs/Twist"
FRAMES = "tf2_msgs/TFMessage"
GRID = "nav_msgs/OccupancyGrid"


@cache
def types_of(dialect):
    """Return the known types of a ROS version; creating them takes a while."""
    return Types(dialect)


class Made:
    """Creates messages of one dialect, and bags with them.

    A moment is a time in seconds since the begin of the bag.
    """

    def __init__(self, dialect):
        self.dialect = dialect
        self.schema = Schema(Dialect(dialect))

    def message(self, type_name, **fields):
        """Return a complete message, with zero for fields that are not given."""
        return self.schema.conform(type_name, fields)

    def time(self, moment):
        return self.schema.dialect.time(BEGIN / 1e9 + moment)

    def odometry(self, moment, x):
        return self.message(
            ODOMETRY,
            header={"stamp": self.time(moment), "frame_id": "odom"},
            child_frame_id="base_link",
            pose={"pose": {"position": {"x": x}, "orientation": {"w": 1.0}}},
        )

    def frame(self, child, moment=0.0):
        transform = {"header": {"stamp": self.time(moment)}, "child_frame_id": child}
        return self.message(FRAMES, transforms=[transform])

    def grid(self, cells):
        origin = {"orientation": {"w": 1.0}}
        size = {"width": len(cells), "height": 1, "resolution": 0.5}
        info = {**size, "origin": origin}
        return self.message(GRID, info=info, data=cells)

    def bag(self, path, *messages):
        """Write topics, types, moments and messages; return the path of the bag."""
        bag, types = new_bag(path, self.dialect), types_of(self.dialect)
        channels = {}
        for topic, type_name, moment, message in messages:
            if topic not in channels:
                version = next(types.versions(type_name))
                channels[topic] = bag.add(topic, version), version
            channel, version = channels[topic]
            time = BEGIN + round(moment * 1e9)
            bag.write(channel, time, version.bytes_of(message))
        bag.close()
        return bag.path
