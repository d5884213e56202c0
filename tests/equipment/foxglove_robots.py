"""Robots behind bridges of Foxglove that record each received velocity and its time."""

import asyncio
import contextlib
import json
import struct
import threading
import time
from queue import Queue

import foxglove
from foxglove.websocket import Capability, ServerListener
from websockets.asyncio.server import serve
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

TYPES = {
    "/cmd_vel": "geometry_msgs/msg/Twist",
    "/odom": "nav_msgs/msg/Odometry",
}

STALL = "/stall"
"""A topic on which any client makes the bridge wait, by a number of milliseconds."""


def twist(vx, wz=0.0):
    return struct.pack("<4s6d", b"\0\1\0\0", vx, 0.0, 0.0, 0.0, 0.0, wz)


def odometry(vx):
    pose = (0.0,) * 43
    texts = struct.pack("<iII5s3xI5s", 0, 0, 5, b"odom\0", 5, b"base\0")
    body = texts + bytes(-len(texts) % 8)
    return b"\0\1\0\0" + body + struct.pack("<79d", *pose, vx, *(0.0,) * 35)


class FoxgloveRobot:
    """The part of a robot that no bridge changes; used as a context manager.

    It moves as it was told, until 0.25 s after the last velocity, and sends odometry at
    20 Hz.
    """

    echoes = True
    """Whether velocities are sent back."""

    def __init__(self):
        self.velocities = []
        """The received velocities: time, forward speed."""
        self.others = []
        """What was received on other topics: topic, bytes."""
        self._ended = threading.Event()
        self._beating = threading.Thread(target=self._beat)

    def __enter__(self):
        self.start()
        self._beating.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        self._beating.join(5)
        self.stop()

    @property
    def url(self):
        return f"foxglove://127.0.0.1:{self.port}"

    def _beat(self):
        while not self._ended.wait(0.05):
            at, vx = self.velocities[-1] if self.velocities else (0.0, 0.0)
            moving = time.monotonic() - at < 0.25
            self.publish("/odom", odometry(vx if moving else 0.0))

    def receive(self, topic, data):
        """Handle a message of a client; where the bridge handles it."""
        if topic == STALL:
            time.sleep(struct.unpack("<4sI", data)[1] / 1000)
        elif topic == "/cmd_vel":
            self.velocities.append((time.monotonic(), struct.unpack("<4s6d", data)[1]))
            if self.echoes:
                self.publish(topic, data)
        else:
            self.others.append((topic, data))

    @property
    def moving(self):
        return [(at, vx) for at, vx in list(self.velocities) if vx]

    @property
    def last_speed(self):
        return self.velocities[-1][1] if self.velocities else None


class SdkRobot(FoxgloveRobot):
    """A robot behind the server of foxglove_bridge 3, with few threads for all."""

    subprotocol = "foxglove.sdk.v1"

    def start(self):
        self._context = foxglove.Context()
        self._channels = {
            topic: foxglove.Channel(
                topic,
                schema=foxglove.Schema(name=type, encoding="ros2msg", data=b""),
                message_encoding="cdr",
                context=self._context,
            )
            for topic, type in TYPES.items()
        }
        robot, topics = self, {}

        class Listener(ServerListener):
            def on_client_advertise(self, client, channel):
                topics[client.id, channel.id] = channel.topic

            def on_message_data(self, client, client_channel_id, data):
                robot.receive(topics[client.id, client_channel_id], data)

        self._server = foxglove.start_server(
            port=0,
            context=self._context,
            capabilities=[Capability.ClientPublish],
            supported_encodings=["cdr", "json"],
            server_listener=Listener(),
        )
        self.port = self._server.port

    def publish(self, topic, data):
        self._channels[topic].log(data)

    def stop(self):
        self._server.stop()


class OldRobot(FoxgloveRobot):
    """A robot behind foxglove_bridge 0.8.5: one thread handles what all clients send.

    Another thread reads the sockets, greets clients and answers pings.
    """

    subprotocol = "foxglove.websocket.v1"

    def start(self):
        self._queue = Queue()
        self._clients = {}
        self._ready = threading.Event()
        self._io = threading.Thread(target=lambda: asyncio.run(self._run()))
        self._handler = threading.Thread(target=self._handle)
        self._io.start()
        assert self._ready.wait(10)
        self._handler.start()

    def stop(self):
        self._queue.put(None)
        self._handler.join(10)
        self._loop.call_soon_threadsafe(self._end.set)
        self._io.join(10)

    def publish(self, topic, data):
        head = struct.pack("<Q", 0)
        for client in list(self._clients.values()):
            for number, channel in list(client["subscribed"].items()):
                if list(TYPES)[channel] == topic:
                    frame = b"\1" + struct.pack("<I", number) + head + data
                    self._send(client["socket"], frame)

    def _send(self, socket, frame):
        async def send():
            with contextlib.suppress(ConnectionClosed):
                await socket.send(frame)

        asyncio.run_coroutine_threadsafe(send(), self._loop)

    async def _run(self):
        self._loop, self._end = asyncio.get_running_loop(), asyncio.Event()
        server = await serve(
            self._serve,
            "127.0.0.1",
            0,
            subprotocols=[self.subprotocol],
            compression=None,
            ping_interval=None,
            max_queue=None,
        )
        self.port = server.sockets[0].getsockname()[1]
        self._ready.set()
        await self._end.wait()
        server.close()
        await server.wait_closed()

    async def _serve(self, socket):
        id = object()
        self._open(id, socket)
        try:
            async for frame in socket:
                self._queue.put((self._on_frame, id, frame))
        except ConnectionClosed:
            pass
        self._queue.put((self._close, id, None))

    def _handle(self):
        while (work := self._queue.get()) is not None:
            do, *arguments = work
            do(*arguments)

    def _open(self, id, socket):
        client = {"socket": socket, "subscribed": {}, "published": {}}
        self._clients[id] = client
        info = {
            "op": "serverInfo",
            "name": "old",
            "capabilities": ["clientPublish"],
            "supportedEncodings": ["cdr"],
        }
        channels = [
            {
                "id": number,
                "topic": topic,
                "encoding": "cdr",
                "schemaName": type,
                "schema": "",
            }
            for number, (topic, type) in enumerate(TYPES.items())
            if self.echoes or topic != "/cmd_vel"
        ]
        self._send(socket, json.dumps(info))
        self._send(socket, json.dumps({"op": "advertise", "channels": channels}))

    def _close(self, id, _):
        self._clients.pop(id, None)

    def _on_frame(self, id, frame):
        client = self._clients[id]
        if isinstance(frame, bytes):
            topic = client["published"][struct.unpack("<I", frame[1:5])[0]]
            self.receive(topic, frame[5:])
            return
        message = json.loads(frame)
        match message["op"]:
            case "subscribe":
                for each in message["subscriptions"]:
                    client["subscribed"][each["id"]] = each["channelId"]
            case "unsubscribe":
                for number in message["subscriptionIds"]:
                    del client["subscribed"][number]
            case "advertise":
                for each in message["channels"]:
                    client["published"][each["id"]] = each["topic"]
            case "unadvertise":
                for number in message["channelIds"]:
                    del client["published"][number]


class OtherClient:
    """Another client of the bridge, which makes it wait; used as a context manager."""

    def __init__(self, robot):
        url = robot.url.replace("foxglove", "ws")
        self._connect = connect(url, subprotocols=[robot.subprotocol], compression=None)

    def __enter__(self):
        self._socket = self._connect.__enter__()
        channel = {
            "id": 1,
            "topic": STALL,
            "encoding": "cdr",
            "schemaName": "std_msgs/msg/UInt32",
        }
        self._socket.send(json.dumps({"op": "advertise", "channels": [channel]}))
        self._reading = threading.Thread(target=self._read)
        self._reading.start()
        return self

    def __exit__(self, *exception):
        self._connect.__exit__(*exception)
        self._reading.join(5)

    def _read(self):
        with contextlib.suppress(ConnectionClosed):
            for _ in self._socket:
                pass

    def stall(self, seconds):
        milliseconds = int(1000 * seconds)
        self._socket.send(struct.pack("<BI4sI", 1, 1, b"\0\1\0\0", milliseconds))
