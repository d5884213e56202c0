"""A rosbridge with a robot that records what each client sends."""

import asyncio
import contextlib
import json
import threading
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import cbor2
import psutil
from websockets.asyncio.server import serve
from websockets.exceptions import ConnectionClosed

PERIOD = 0.05
"""Seconds between two messages of odometry."""

REST = {
    "linear": {"x": 0.0, "y": 0.0, "z": 0.0},
    "angular": {"x": 0.0, "y": 0.0, "z": 0.0},
}


@dataclass
class Link:
    """One WebSocket to the robot."""

    of_gate: bool
    """Whether a gate process owned the socket when it opened."""
    socket: Any
    topics: dict[str, dict[str, Any]] = field(default_factory=dict)
    """The subscriptions by topic."""
    received: list[dict[str, Any]] = field(default_factory=list)

    @property
    def ids(self) -> list[str]:
        """The ids of the received messages."""
        return [str(message.get("id", "")) for message in list(self.received)]

    @property
    def by_gate(self) -> bool:
        """Whether a gate process opened the socket, and not the display."""
        # A socket that was closed at once had no owner when it was checked.
        return self.of_gate or any(id.startswith("webmap-gate") for id in self.ids)

    @property
    def lane(self) -> str:
        """The gate's use of the link, which follows from its messages."""
        ids, ops = self.ids, {message["op"] for message in list(self.received)}
        if not self.by_gate:
            return "display"
        if any(id.startswith("webmap-gate echo") for id in ids):
            return "control"
        if any(
            id.startswith(("webmap-gate odometry", "webmap-gate scan")) for id in ids
        ):
            return "witness"
        return "call" if ops == {"call_service"} else "tasks"


class Robot:
    """Serves in a thread, so that a script may block; used as a context manager.

    It follows its velocity topic at once: odometry reports the last velocity. It sends
    published messages to every subscriber.

    Args:
        types: The types of topics that rosapi reports.
        velocity: The topic whose velocities it follows.

    """

    def __init__(self, types: dict[str, str] | None = None, velocity: str = "/cmd_vel"):
        self.types = types or {}
        self.publishers: dict[str, list[str]] = {}
        """Nodes by topic, as rosapi reports them."""
        self.velocity = velocity
        self.links: list[Link] = []
        self.repeated: dict[str, dict[str, Any]] = {}
        """Messages that it publishes periodically besides odometry, by topic."""
        self.follows = True
        """Whether it follows its commands."""
        self.now = REST
        self._ready = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._run()))

    def __enter__(self):
        self._thread.start()
        assert self._ready.wait(10)
        return self

    def __exit__(self, *_):
        self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join(10)

    @property
    def url(self):
        return f"ws://127.0.0.1:{self.port}"

    # For scripts.

    def received(self, op, topic=None, by_gate=True):
        """Return the received messages with an operation, oldest first."""
        return [
            message
            for link in self.links
            for message in list(link.received)
            if link.by_gate == by_gate
            and message["op"] == op
            and topic in (None, message.get("topic"))
        ]

    @property
    def speeds(self):
        """The forward speeds that were published."""
        published = self.received("publish", self.velocity)
        return [twist_in(message["msg"])["linear"]["x"] for message in published]

    def link_that(self, op):
        """Return the last link that sent an operation."""
        return next(
            link
            for link in reversed(self.links)
            if any(message["op"] == op for message in link.received)
        )

    def send(self, link, message):
        """Send an operation over one link."""
        work = link.socket.send(json.dumps(message))
        asyncio.run_coroutine_threadsafe(work, self._loop).result(5)

    def publish(self, topic, message):
        """Publish a message, as a node of the robot."""
        work = self._publish(topic, message)
        asyncio.run_coroutine_threadsafe(work, self._loop).result(5)

    # The server.

    async def _run(self):
        self._loop, self._end = asyncio.get_running_loop(), asyncio.Event()
        server = await serve(
            self._serve, "127.0.0.1", 0, compression=None, ping_interval=None
        )
        self.port = server.sockets[0].getsockname()[1]
        moving = asyncio.create_task(self._move())
        self._ready.set()
        await self._end.wait()
        moving.cancel()
        server.close()
        await server.wait_closed()

    async def _serve(self, socket):
        port = socket.remote_address[1]
        link = Link(port in ports_of_gates(), socket)
        self.links.append(link)
        with contextlib.suppress(ConnectionClosed):
            async for frame in socket:
                message = json.loads(frame)
                link.received.append(message)
                await self._answer(link, message)
        link.topics.clear()

    async def _answer(self, link, message):
        match message["op"]:
            case "subscribe":
                link.topics[message["topic"]] = message
            case "unsubscribe":
                link.topics.pop(message["topic"], None)
            case "publish":
                if message["topic"] == self.velocity and self.follows:
                    self.now = twist_in(message["msg"])
                await self._publish(message["topic"], message["msg"])
            case "call_service":
                values = self._called(message["service"], message.get("args"))
                answer = {"op": "service_response", "id": message["id"]}
                answer |= {"values": values, "result": True}
                await link.socket.send(json.dumps(answer))

    def _called(self, service, args):
        topic = args.get("topic") if isinstance(args, dict) else None
        match service:
            case "/rosapi/topic_type":
                return {"type": self.types.get(topic, "")}
            case "/rosapi/publishers":
                return {"publishers": self.publishers.get(topic, ["/base"])}
            case "/rosapi/topics":
                return {"topics": list(self.types), "types": list(self.types.values())}
            case "/e_stop":
                return {"success": True, "message": ""}
        return {}

    async def _publish(self, topic, message):
        for link in list(self.links):
            subscription = link.topics.get(topic)
            if subscription is None:
                continue
            operation = {"op": "publish", "topic": topic, "msg": message}
            in_cbor = subscription.get("compression") == "cbor"
            data = cbor2.dumps(operation) if in_cbor else json.dumps(operation)
            with contextlib.suppress(ConnectionClosed):
                await link.socket.send(data)

    async def _move(self):
        while True:
            await asyncio.sleep(PERIOD)
            pose = {
                "position": {"x": 1.0, "y": 2.0, "z": 0.0},
                "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
            }
            odometry = {
                "header": {"frame_id": "odom", "stamp": {"sec": 0, "nanosec": 0}},
                "child_frame_id": "base_link",
                "pose": {"pose": pose, "covariance": [0.0] * 36},
                "twist": {"twist": self.now, "covariance": [0.0] * 36},
            }
            await self._publish("/odom", odometry)
            for topic, message in list(self.repeated.items()):
                await self._publish(topic, message)


def twist_in(message):
    """Return the velocity of a Twist or a TwistStamped."""
    return message.get("twist", message)


def ports_of_gates():
    """Return the ports of the sockets of gates that this process started."""
    found = set()
    for child in psutil.Process().children():
        with contextlib.suppress(psutil.Error):
            if "webmap.gate" in child.cmdline():
                found |= {each.laddr.port for each in child.net_connections("tcp")}
    return found


def scan_of(distance):
    """Return a scan with a wall on all sides at a distance, in metres."""
    return {
        "header": {"frame_id": "laser", "stamp": {"sec": 0, "nanosec": 0}},
        "angle_min": -3.0,
        "angle_max": 3.0,
        "angle_increment": 0.05,
        "time_increment": 0.0,
        "scan_time": 0.1,
        "range_min": 0.05,
        "range_max": 30.0,
        "ranges": [distance] * 121,
        "intensities": [],
    }


def transforms(frames):
    """Return a message of ``/tf`` with a chain of frames."""
    nothing = {"x": 0.0, "y": 0.0, "z": 0.0}
    here = {"translation": nothing, "rotation": {**nothing, "w": 1.0}}
    return {
        "transforms": [
            {
                "header": {"frame_id": parent, "stamp": {"sec": 0, "nanosec": 0}},
                "child_frame_id": child,
                "transform": here,
            }
            for parent, child in pairwise(frames)
        ]
    }
