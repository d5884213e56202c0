"""Real Foxglove servers with a small robot: as a fixture, and as a program.

``SdkServer`` is the server of ``foxglove_bridge`` 3 (``foxglove.sdk.v1``, CDR).
``OldServer`` speaks as version 0.8.5 does for ROS 1 (``foxglove.websocket.v1``).
rosbags makes the messages, so that WebMap reads bytes that it has not written.

Try it by hand with ``python tests/equipment/foxglove_server.py sdk 8765``.
"""

import asyncio
import io
import logging
import math
import sys
import time
import warnings
from contextlib import asynccontextmanager, contextmanager, suppress

import foxglove
import numpy as np
from foxglove.websocket import Capability
from PIL import Image
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

with warnings.catch_warnings():  # this package is not developed any more
    warnings.simplefilter("ignore", DeprecationWarning)
    from foxglove_websocket.server import FoxgloveServer, FoxgloveServerListener

VELOCITY = "/cmd_vel"
SERVICE = "/dock"


class Robot:
    """A robot that drives as it is told; its messages come from rosbags.

    Args:
        ros2: Whether the messages are of ROS 2, in CDR.

    """

    def __init__(self, *, ros2):
        self.ros2 = ros2
        self.store = get_typestore(Stores.ROS2_HUMBLE if ros2 else Stores.ROS1_NOETIC)
        frames = "tf2_msgs/msg/TFMessage"
        if frames not in self.store.types:
            text = "geometry_msgs/TransformStamped[] transforms"
            self.store.register(get_types_from_msg(text, frames))
        self.x = self.y = self.turn = 0.0
        self.speed = self.rate = 0.0
        self.docked = 0
        self.parameters = {"/robot.gain": 1.5}

    def type_name(self, type):
        """Return the name of a type in the dialect; ``type`` is that of ROS 1."""
        package, _, name = type.partition("/")
        return f"{package}/msg/{name}" if self.ros2 else type

    def schema(self, type):
        """Return the definition of a type and its parts as one text."""
        name = type.replace("/", "/msg/")
        return self.store.generate_msgdef(name, ros_version=2 if self.ros2 else 1)[0]

    def data(self, type, **fields):
        """Return a serialized message; absent fields are zero or empty."""
        name = type.replace("/", "/msg/")
        message = self._make(name, fields)
        if self.ros2:
            return bytes(self.store.serialize_cdr(message, name))
        return bytes(self.store.serialize_ros1(message, name))

    def read(self, type, data):
        """Return a message of a client."""
        name = type if "/msg/" in type else type.replace("/", "/msg/")
        if self.ros2:
            return self.store.deserialize_cdr(data, name)
        return self.store.deserialize_ros1(data, name)

    def _make(self, name, fields):
        values = {}
        for field, (node, about) in self.store.fielddefs[name][1]:
            given = fields.get(field)
            if node.name == "NAME":
                is_made = given is not None and not isinstance(given, dict)
                values[field] = given if is_made else self._make(about, given or {})
            elif node.name == "BASE":
                values[field] = self._zero(about[0]) if given is None else given
            else:
                values[field] = self._array(node, about, given)
        return self.store.types[name](**values)

    def _array(self, node, about, given):
        (inner, type), size = about
        if inner.name == "NAME":
            return [self._make(type, each) for each in given or []]
        if type[0] == "string":
            return list(given or [])
        if given is None:
            given = np.zeros(size if node.name == "ARRAY" else 0)
        return np.array(given, dtype={"byte": "uint8"}.get(type[0], type[0]))

    def _zero(self, type):
        return {"string": "", "bool": False}.get(type, 0)

    def header(self, frame):
        """Return a header with the time of now."""
        secs, rest = divmod(time.time_ns(), 10**9)
        stamp = self._make(
            "builtin_interfaces/msg/Time", {"sec": secs, "nanosec": rest}
        )
        return {"stamp": stamp, "frame_id": frame}

    def step(self, seconds):
        """Drive for some time."""
        self.turn += self.rate * seconds
        self.x += self.speed * math.cos(self.turn) * seconds
        self.y += self.speed * math.sin(self.turn) * seconds

    def obey(self, data):
        """Take a velocity."""
        twist = self.read("geometry_msgs/Twist", data)
        self.speed, self.rate = twist.linear.x, twist.angular.z

    def pose(self):
        turned = {"z": math.sin(self.turn / 2), "w": math.cos(self.turn / 2)}
        return {"position": {"x": self.x, "y": self.y}, "orientation": turned}

    def odometry(self):
        return self.data(
            "nav_msgs/Odometry",
            header=self.header("odom"),
            child_frame_id="base_link",
            pose={"pose": self.pose()},
            twist={"twist": {"linear": {"x": self.speed}, "angular": {"z": self.rate}}},
        )

    def frames(self):
        pose = self.pose()
        moved = {"translation": pose["position"], "rotation": pose["orientation"]}
        one = {"header": self.header("odom"), "child_frame_id": "base_link"}
        return self.data("tf2_msgs/TFMessage", transforms=[{**one, "transform": moved}])

    def scan(self):
        return self.data(
            "sensor_msgs/LaserScan",
            header=self.header("base_link"),
            angle_min=-math.pi,
            angle_max=math.pi,
            angle_increment=math.pi / 180,
            range_min=0.1,
            range_max=10.0,
            ranges=[2.0 + math.sin(i / 20) for i in range(360)],
        )

    def battery(self):
        return self.data(
            "sensor_msgs/BatteryState",
            header=self.header(""),
            percentage=0.8,
            voltage=24.5,
            present=True,
        )

    def map(self, width=200, height=120):
        cells = np.zeros((height, width), dtype=np.int8)
        cells[0, :] = cells[-1, :] = cells[:, 0] = cells[:, -1] = 100
        return self.data(
            "nav_msgs/OccupancyGrid",
            header=self.header("odom"),
            info={
                "resolution": 0.05,
                "width": width,
                "height": height,
                "origin": {"position": {"x": -5.0, "y": -3.0}, "orientation": {"w": 1}},
            },
            data=cells.ravel(),
        )

    def picture(self):
        made = io.BytesIO()
        Image.new("RGB", (64, 48), (200, int(time.time() * 50) % 256, 40)).save(
            made, "JPEG"
        )
        return self.data(
            "sensor_msgs/CompressedImage",
            header=self.header("camera"),
            format="jpeg",
            data=np.frombuffer(made.getvalue(), dtype=np.uint8),
        )


TOPICS = {
    "/odom": ("nav_msgs/Odometry", Robot.odometry, 0.05),
    "/tf": ("tf2_msgs/TFMessage", Robot.frames, 0.05),
    "/scan": ("sensor_msgs/LaserScan", Robot.scan, 0.1),
    "/battery_state": ("sensor_msgs/BatteryState", Robot.battery, 1.0),
    "/map": ("nav_msgs/OccupancyGrid", Robot.map, 1.0),
    "/camera/image/compressed": ("sensor_msgs/CompressedImage", Robot.picture, 0.1),
    VELOCITY: ("geometry_msgs/Twist", None, 0.0),
}
"""Of each topic the type, the function that makes a message, and the period."""


async def live(server):
    """Let the robot drive and publish."""
    due = dict.fromkeys(TOPICS, 0.0)
    before = time.monotonic()
    while True:
        now = time.monotonic()
        server.robot.step(now - before)
        before = now
        for topic, (_, make, period) in TOPICS.items():
            if make is not None and now >= due[topic]:
                due[topic] = now + period
                await server.publish(topic, make(server.robot))
        await asyncio.sleep(0.02)


class SdkServer:
    """The server of foxglove-sdk, which ``foxglove_bridge`` 3 is made of."""

    def __init__(self, port=0, topics=TOPICS, *, capabilities=None, services=True):
        self.robot = Robot(ros2=True)
        self.received = []
        self.advertised = []
        self.subscribed = []
        self.graph_watched = False
        self.context = foxglove.Context()
        self.channels = {}
        for topic, (type, *_) in topics.items():
            self.add(topic, type)
        self._server = foxglove.start_server(
            name="robot",
            port=port,
            capabilities=[
                Capability.ClientPublish,
                Capability.Services,
                Capability.Parameters,
                Capability.ConnectionGraph,
                Capability.Time,
            ]
            if capabilities is None
            else capabilities,
            supported_encodings=["cdr", "json"],
            server_listener=self,
            services=[self._trigger()] if services else [],
            context=self.context,
        )
        self.port = self._server.port
        self.url = f"foxglove://127.0.0.1:{self.port}"

    def add(self, topic, type, *, schema=None, encoding="cdr", language="ros2msg"):
        """Offer a topic."""
        text = self.robot.schema(type) if schema is None else schema
        name = self.robot.type_name(type)
        self.channels[topic] = foxglove.Channel(
            topic,
            message_encoding=encoding,
            schema=foxglove.Schema(name=name, encoding=language, data=text.encode()),
            context=self.context,
        )

    def remove(self, topic):
        self.channels.pop(topic).close()

    async def publish(self, topic, data):
        self.channels[topic].log(data)

    def graph(self, publishers=None, subscribers=None):
        """Publish the nodes of topics.

        This waits forever if a client subscribes to the graph at the same time: the
        server calls its listener with a lock that publishing waits for.
        """
        graph = foxglove.ConnectionGraph()
        for topic, nodes in (publishers or {}).items():
            graph.set_published_topic(topic, nodes)
        for topic, nodes in (subscribers or {}).items():
            graph.set_subscribed_topic(topic, nodes)
        self._server.publish_connection_graph(graph)

    def status(self, text):
        self._server.publish_status(text, foxglove.StatusLevel.Error)

    def time(self, seconds):
        self._server.broadcast_time(int(seconds * 1e9))

    def stop(self):
        self._server.stop()

    def _trigger(self):
        def part(name, text):
            schema = foxglove.Schema(
                name=f"std_srvs/srv/Trigger_{name}", encoding="ros2msg", data=text
            )
            return foxglove.MessageSchema(encoding="cdr", schema=schema)

        schema = foxglove.ServiceSchema(
            "std_srvs/srv/Trigger",
            request=part("Request", b""),
            response=part("Response", b"bool success\nstring message"),
        )
        return foxglove.Service(SERVICE, schema=schema, handler=self._dock)

    def _dock(self, request):
        self.robot.docked += 1
        if self.robot.docked == 13:
            raise RuntimeError("no dock here")
        return b"\0\1\0\0\1\0\0\0\7\0\0\0docked\0"

    # The listener of the server; it is called in other threads.

    def on_subscribe(self, client, channel):
        self.subscribed.append(channel.topic)

    def on_unsubscribe(self, client, channel):
        with suppress(ValueError):
            self.subscribed.remove(channel.topic)

    def on_client_advertise(self, client, channel):
        self.advertised.append(channel)

    def on_client_unadvertise(self, client, channel_id):
        self.advertised = [each for each in self.advertised if each.id != channel_id]

    def on_message_data(self, client, client_channel_id, data):
        for channel in self.advertised:
            if channel.id == client_channel_id:
                self.received.append((channel.topic, data))
                if channel.topic == VELOCITY:
                    self.robot.obey(data)
                    self.channels[VELOCITY].log(data)

    def on_get_parameters(self, client, names, request_id=None):
        known = self.robot.parameters
        return [
            foxglove.Parameter(name, value=known[name])
            for name in names or known
            if name in known
        ]

    def on_set_parameters(self, client, parameters, request_id=None):
        for each in parameters:
            if each.name in self.robot.parameters:
                self.robot.parameters[each.name] = each.get_value()
        return self.on_get_parameters(client, [each.name for each in parameters])

    def on_parameters_subscribe(self, names):
        pass

    def on_parameters_unsubscribe(self, names):
        pass

    def on_connection_graph_subscribe(self):
        self.graph_watched = True

    def on_connection_graph_unsubscribe(self):
        pass


@contextmanager
def sdk_server(*args, **options):
    server = SdkServer(*args, **options)
    try:
        yield server
    finally:
        server.stop()


class OldServer(FoxgloveServerListener):
    """The server of foxglove-websocket, with the messages of ROS 1."""

    def __init__(self, port=0, topics=TOPICS):
        self.robot = Robot(ros2=False)
        self.received = []
        self.subscribed = []
        self._topics = topics
        self._ids = {}
        self._topic_of = {}
        logger = logging.getLogger("webmap.tests.foxglove")
        logger.setLevel(logging.ERROR)
        self._server = FoxgloveServer(
            "127.0.0.1",
            port,
            "robot",
            capabilities=["clientPublish", "services", "parameters"],
            supported_encodings=["ros1"],
            logger=logger,
        )

    async def start(self):
        self._server.set_listener(self)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            self._server.start()
            opened = await self._server.wait_opened()
        self.port = opened.sockets[0].getsockname()[1]
        self.url = f"foxglove://127.0.0.1:{self.port}"
        for topic, (type, *_) in self._topics.items():
            await self.add(topic, type)
        await self._server.add_service(
            {
                "name": SERVICE,
                "type": "std_srvs/Trigger",
                "requestSchema": "",
                "responseSchema": "bool success\nstring message",
            }
        )

    async def add(self, topic, type):
        id = await self._server.add_channel(
            {
                "topic": topic,
                "encoding": "ros1",
                "schemaName": type,
                "schema": self.robot.schema(type),
            }
        )
        self._ids[topic] = id

    async def remove(self, topic):
        await self._server.remove_channel(self._ids.pop(topic))

    async def publish(self, topic, data):
        await self._server.send_message(self._ids[topic], time.time_ns(), data)

    async def stop(self):
        self._server.close()
        await self._server.wait_closed()

    def _name(self, id):
        return next(topic for topic, each in self._ids.items() if each == id)

    async def on_subscribe(self, server, channel_id):
        self.subscribed.append(self._name(channel_id))

    async def on_client_advertise(self, server, channel):
        self._topic_of[channel["id"]] = channel["topic"]

    async def on_client_message(self, server, channel_id, payload):
        topic = self._topic_of[channel_id]
        self.received.append((topic, payload))
        if topic == VELOCITY:
            self.robot.obey(payload)
            await self.publish(VELOCITY, payload)

    async def on_service_request(self, server, service_id, call_id, encoding, payload):
        self.robot.docked += 1
        return b"\1\6\0\0\0docked"

    async def on_set_parameters(self, server, params, request_id):
        for each in params:
            self.robot.parameters[each["name"]] = each["value"]
        return params


@asynccontextmanager
async def old_server(*args, **options):
    server = OldServer(*args, **options)
    await server.start()
    try:
        yield server
    finally:
        await server.stop()


async def _main(kind, port):
    if kind == "sdk":
        server = SdkServer(port)
    else:
        server = OldServer(port)
        await server.start()
    print(f"serving {server.url}", flush=True)
    await live(server)


if __name__ == "__main__":
    with suppress(KeyboardInterrupt):
        asyncio.run(_main(sys.argv[1], int(sys.argv[2])))
