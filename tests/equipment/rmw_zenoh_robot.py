"""A robot whose nodes speak as rmw_zenoh does, over a real Zenoh router on loopback.

The tokens, the keys and the attachments are written as ``docs/design.md`` and the
sources of rmw_zenoh describe them; rosbags makes the messages and the type hashes.

Try it by hand in ``tests`` with ``python -m equipment.rmw_zenoh_robot 7447``.
"""

import json
import sys
import time
from contextlib import contextmanager
from itertools import count

import zenoh
from rosbags.typesys import Stores, get_typestore
from zenoh import ext

from equipment.foxglove_server import Robot

TOPICS = {
    "/odom": ("nav_msgs/Odometry", Robot.odometry, False),
    "/scan": ("sensor_msgs/LaserScan", Robot.scan, False),
    "/tf": ("tf2_msgs/TFMessage", Robot.frames, False),
    "/map": ("nav_msgs/OccupancyGrid", Robot.map, True),
}
"""Type, function that makes a message, and whether it is transient local."""

VELOCITY = ("/cmd_vel", "geometry_msgs/Twist")
ID = "8b20917502ee955ac4476e0266340d5c"
GID = bytes(range(16))


def _session(mode, endpoint, **settings):
    place = "listen" if mode == "router" else "connect"
    found = {"multicast": {"enabled": False}, "gossip": {"enabled": mode != "client"}}
    settings = {
        "mode": mode,
        "scouting": found,
        "timestamping": {"enabled": True},
        place: {"endpoints": [endpoint]},
        "transport": {"shared_memory": {"enabled": False}},
        **settings,
    }
    if mode == "peer":
        settings["listen"] = {"endpoints": ["tcp/127.0.0.1:0"]}
    return zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))


def attachment_of(number):
    """Return the attachment of rmw_zenoh since ROS 2 Kilted."""
    stamp = time.time_ns().to_bytes(8, "little")
    return number.to_bytes(8, "little") + stamp + b"\x10" + GID


class RmwZenohRobot:
    """One session with nodes of a robot, as a process with rmw_zenoh has it.

    Args:
        port: The port of the router on this computer.
        domain: ``ROS_DOMAIN_ID``.
        store: The release of ROS 2 whose definitions the robot has.

    """

    def __init__(self, port, domain=0, store=Stores.ROS2_KILTED):
        self.robot = Robot(ros2=True)
        self.robot.store = get_typestore(store)
        self.domain = domain
        self.url = f"zenoh-ros2://127.0.0.1:{port}"
        self.session = _session("peer", f"tcp/127.0.0.1:{port}")
        self.publishers = {}
        self._tokens = {}
        self._ids = count(1)
        self._numbers = count(1)
        self.token("NN")

    def close(self):
        """End as a process does that is told to."""
        self.session.close()

    def hash_of(self, type):
        """Return the hash of a type, whose name is that of ROS 1."""
        return self.robot.store.hash_rihs01(type.replace("/", "/msg/"))

    def token(self, kind, *parts, node="robot", space="%"):
        """Declare a token; return its key."""
        words = [ID, "0", str(next(self._ids)), kind, "%", space, node, *parts]
        return self.declare(f"@ros2_lv/{self.domain}/" + "/".join(words))

    def declare(self, key):
        """Declare any liveliness token."""
        self._tokens[key] = self.session.liveliness().declare_token(key)
        return key

    def undeclare(self, key):
        """End a token."""
        self._tokens.pop(key).undeclare()

    def announce(self, kind, topic, type, *, hash=None, latched=False, node="robot"):
        """Announce a publisher (MP), a subscriber (MS) or a service (SS)."""
        quality = f":{'1' if latched else ''}:,10:,:,:,,"
        parts = (*self._names(type, hash), quality)
        return self.token(kind, topic.replace("/", "%"), *parts, node=node)

    def _names(self, type, hash):
        package, _, name = type.partition("/")
        kind = "srv" if package.endswith("_srvs") else "msg"
        return f"{package}::{kind}::dds_::{name}_", hash or self.hash_of(type)

    def add(self, topic, type, *, hash=None, latched=False, all=False, node="robot"):
        """Make a publisher, and return its token.

        It is reliable with a KEEP_ALL history for ``all``. Any other one drops messages
        while the connection is busy.
        """
        key = "/".join((str(self.domain), topic[1:], *self._names(type, hash)))
        kept = {"cache": ext.CacheConfig(1)} if latched else {}
        congestion = zenoh.CongestionControl
        self.publishers[topic] = ext.declare_advanced_publisher(
            self.session,
            key,
            congestion_control=congestion.BLOCK if all else congestion.DROP,
            publisher_detection=latched,
            **kept,
        )
        return self.announce("MP", topic, type, hash=hash, latched=latched, node=node)

    def publish(self, topic, data, attachment=None):
        """Publish bytes; with the attachment of rmw_zenoh if none is given."""
        made = attachment_of(next(self._numbers)) if attachment is None else attachment
        self.publishers[topic].put(data, attachment=made)

    def live(self):
        """Publish a message on each topic, as the robot moves."""
        self.robot.step(0.1)
        for topic, (_, make, latched) in TOPICS.items():
            if not latched:
                self.publish(topic, make(self.robot))


@contextmanager
def router(port=0):
    """Run a router on loopback; yield its port."""
    from webmap.agents.router import free_port

    place = free_port(f"tcp/127.0.0.1:{port}")
    session = _session("router", place)
    try:
        yield int(place.rpartition(":")[2])
    finally:
        session.close()


@contextmanager
def rmw_zenoh_robot(port, *, topics=TOPICS, **options):
    """Run a robot with some topics; its map is published once."""
    robot = RmwZenohRobot(port, **options)
    try:
        for topic, (type, make, latched) in topics.items():
            robot.add(topic, type, latched=latched)
            if latched:
                robot.publish(topic, make(robot.robot))
        robot.announce("MS", *VELOCITY)
        yield robot
    finally:
        robot.close()


if __name__ == "__main__":
    with router(int(sys.argv[1])) as chosen, rmw_zenoh_robot(chosen) as lively:
        print(f"zenoh-ros2://localhost:{chosen}", flush=True)
        lively.robot.speed = 0.1
        while True:
            lively.live()
            time.sleep(0.1)
