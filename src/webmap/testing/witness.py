"""A robot that records its commands, with or without a command timeout."""

import asyncio
import contextlib
import json
import math
import time
from collections.abc import Callable, Iterator
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from webmap.base.geometry import Pose, Twist
from webmap.base.tasks import LoopThread
from webmap.sim.robot import BaseOptions, SimRobot
from webmap.testing.invariants import ClientMessage, Moved, ReceivedTwist, WitnessLog

OnMessage = Callable[[int, dict[str, Any]], None]


class WitnessSocket:
    """One WebSocket of a client."""

    def __init__(self, number: int, connection: ServerConnection) -> None:
        self.number = number
        self.connection = connection
        self.topics: dict[str, int] = {}
        """Number of subscriptions to each topic."""


class WitnessBridge:
    """A rosbridge server that reports every message before it processes it.

    The messages of one socket are processed in order, as in rosbridge, so a message
    that hangs delays all later ones while pings are still answered.

    Args:
        on_message: Called with the number of the socket and the message.

    """

    def __init__(self, on_message: OnMessage) -> None:
        self.answers_services = True
        """Whether calls are answered; else they hang, with all later messages of the
        socket."""
        self.goals_block = False
        """Whether a goal runs on its socket's input thread until it ends."""
        self.types: dict[str, str] = {}
        """The topics that rosapi lists, with their types."""
        self.publishers: dict[str, list[str]] = {}
        """The nodes that rosapi lists as publishers of a topic."""
        self.port = 0
        self._on_message = on_message
        self._sockets: dict[int, WitnessSocket] = {}
        self._count = 0
        self._server: Server | None = None
        self._unblocked = asyncio.Event()

    async def start(self) -> None:
        """Listen; on the previous port, if there was one."""
        self._server = await serve(
            self._serve,
            "127.0.0.1",
            self.port,
            compression=None,
            ping_interval=None,  # like rosbridge: pings are off by default
            max_queue=None,  # a handler that hangs must not delay pongs
        )
        self.port = next(iter(self._server.sockets)).getsockname()[1]

    async def stop(self) -> None:
        """Drop every connection without a close frame and stop listening."""
        if self._server is None:
            return
        server, self._server = self._server, None
        server.close(close_connections=False)
        for socket in list(self._sockets.values()):
            socket.connection.transport.abort()
        self.unblock()
        await server.wait_closed()

    def unblock(self) -> None:
        """Release the calls and goals that hang."""
        self._unblocked.set()
        self._unblocked = asyncio.Event()

    async def publish(self, topic: str, message: dict[str, Any]) -> None:
        """Send a message to all who subscribed to its topic."""
        text = json.dumps({"op": "publish", "topic": topic, "msg": message})
        for socket in list(self._sockets.values()):
            if socket.topics.get(topic):
                with contextlib.suppress(ConnectionClosed):
                    await socket.connection.send(text)

    async def _serve(self, connection: ServerConnection) -> None:
        self._count += 1
        socket = WitnessSocket(self._count, connection)
        self._sockets[socket.number] = socket
        try:
            async for frame in connection:
                for message in _read(frame):
                    self._on_message(socket.number, message)
                    await self._process(socket, message)
        except ConnectionClosed:
            pass
        finally:
            del self._sockets[socket.number]

    async def _process(self, socket: WitnessSocket, message: dict[str, Any]) -> None:
        topic = str(message.get("topic"))
        match message.get("op"):
            case "subscribe":
                socket.topics[topic] = socket.topics.get(topic, 0) + 1
            case "unsubscribe":
                socket.topics[topic] = max(socket.topics.get(topic, 0) - 1, 0)
            case "publish":
                await self.publish(topic, message.get("msg") or {})
            case "call_service":
                await self._serve_call(socket, message)
            case "send_action_goal" if self.goals_block:
                await self._unblocked.wait()

    async def _serve_call(self, socket: WitnessSocket, message: dict[str, Any]) -> None:
        service = str(message.get("service"))
        if not self.answers_services and not service.startswith("/rosapi/"):
            await self._unblocked.wait()
        answer = {
            "op": "service_response",
            "service": service,
            "id": message.get("id"),
            "values": self._values(service, message.get("args") or {}),
            "result": True,
        }
        await socket.connection.send(json.dumps(answer))

    def _values(self, service: str, args: Any) -> dict[str, Any]:
        match service:
            case "/rosapi/topics":
                return {"topics": list(self.types), "types": list(self.types.values())}
            case "/rosapi/topic_type" if isinstance(args, dict):
                return {"type": self.types.get(str(args.get("topic")), "")}
            case "/rosapi/publishers" if isinstance(args, dict):
                nodes = self.publishers.get(str(args.get("topic")))
                if nodes is not None:
                    return {"publishers": nodes}
        return {"success": True, "message": ""}


def _read(frame: str | bytes) -> Iterator[dict[str, Any]]:
    try:
        message = json.loads(frame)
    except (ValueError, RecursionError):
        message = None
    if isinstance(message, dict):
        yield message


STEP = 0.01
"""Seconds between two steps of the base."""

ODOMETRY_EVERY = 5
"""Steps between two odometry messages, which gives 20 a second."""


class WitnessRobot:
    """A base behind its own rosbridge, in its own thread.

    Used as a context manager. All its commands are in :attr:`log`, with the time of the
    monotonic clock, which all processes of one machine share. It has good brakes: it
    follows a command within a few hundredths of a second, so that the times in the log
    are those of the commands.

    Args:
        timeout: Seconds without a command until the base stops by itself; None for a
            base that never does.
        obeys: Whether it follows commands.
        flies: Whether it moves upward and downward; it is a differential base if not.
        goals_block: Whether a goal runs on its socket's input thread.

    """

    TWIST_TOPIC = "/cmd_vel"
    ODOMETRY_TOPIC = "/odom"

    def __init__(
        self,
        *,
        timeout: float | None = 0.5,
        obeys: bool = True,
        flies: bool = False,
        goals_block: bool = False,
    ) -> None:
        self.log = WitnessLog()
        self.obeys = obeys
        self.sends_telemetry = True
        """Whether odometry is published."""
        options = BaseOptions(
            v_max=5.0,
            w_max=10.0,
            z_max=5.0 if flies else 0.0,
            acceleration=50.0,
            turn_acceleration=100.0,
            timeout=timeout,
        )
        self._base = SimRobot("", Pose(), options)
        self._thread = LoopThread("witness-robot")
        self._bridge = self._thread.do(WitnessBridge, self._on_message)
        self._bridge.goals_block = goals_block
        self._bridge.types = {
            self.TWIST_TOPIC: "geometry_msgs/Twist",
            self.ODOMETRY_TOPIC: "nav_msgs/Odometry",
        }
        self._thread.call(self._bridge.start())
        self._life = self._thread.do(lambda: asyncio.ensure_future(self._live()))

    def __enter__(self) -> "WitnessRobot":
        return self

    def __exit__(self, *exception: object) -> None:
        self.end()

    def end(self) -> None:
        """Close all connections and end the thread; the log stays."""
        self._thread.call(self._bridge.stop())
        self._thread.end()

    @property
    def port(self) -> int:
        """Port of its rosbridge, on the loopback address."""
        return self._bridge.port

    @property
    def url(self) -> str:
        """The address of its rosbridge."""
        return f"ws://127.0.0.1:{self.port}"

    @property
    def velocity(self) -> Twist:
        """Velocity of the wheels now."""
        return self._base.twist

    def kill_bridge(self) -> None:
        """End its rosbridge without a close frame; the base keeps running."""
        self._thread.call(self._bridge.stop())

    def restart_bridge(self) -> None:
        """Start its rosbridge again, on the same port."""
        self._thread.call(self._bridge.start())

    def unblock(self) -> None:
        """Release calls and goals that hang."""
        self._thread.do(self._bridge.unblock)

    def answers_services(self, answers: bool) -> None:
        """Answer calls from now on, or let them hang."""
        self._bridge.answers_services = answers

    def publish(self, topic: str, message: dict[str, Any]) -> None:
        """Publish a message to all subscribers of a topic."""
        self._thread.call(self._bridge.publish(topic, message))

    def _on_message(self, link: int, message: dict[str, Any]) -> None:
        now = time.monotonic()
        self.log.messages.append(ClientMessage(now, link, message))
        if message.get("op") != "publish" or message.get("topic") != self.TWIST_TOPIC:
            return
        twist = _twist(message.get("msg"))
        self.log.twists.append(ReceivedTwist(now, twist, link))
        if self.obeys:
            self._base.command(twist, now)

    async def _live(self) -> None:
        steps = 0
        before = time.monotonic()
        while True:
            await asyncio.sleep(STEP)
            now = time.monotonic()
            self._base.step(now - before, now, lambda x, y: False)
            before = now
            self.log.moved.append(Moved(now, self._base.twist))
            steps += 1
            if self.sends_telemetry and steps % ODOMETRY_EVERY == 0:
                await self._bridge.publish(self.ODOMETRY_TOPIC, self._odometry())

    def _odometry(self) -> dict[str, Any]:
        pose, twist = self._base.pose, self._base.twist
        half = pose.yaw / 2
        return {
            "header": {"stamp": {"secs": 0, "nsecs": 0}, "frame_id": "odom"},
            "child_frame_id": "base_link",
            "pose": {
                "pose": {
                    "position": {"x": pose.x, "y": pose.y, "z": self._base.height},
                    "orientation": {
                        "x": 0.0,
                        "y": 0.0,
                        "z": math.sin(half),
                        "w": math.cos(half),
                    },
                },
                "covariance": [0.0] * 36,
            },
            "twist": {
                "twist": twist.to_message(),
                "covariance": [0.0] * 36,
            },
        }


def _twist(message: Any) -> Twist:
    """Read a Twist or a TwistStamped; a value that is not a number becomes NaN."""
    inner = message.get("twist", message) if isinstance(message, dict) else {}
    linear, angular = inner.get("linear") or {}, inner.get("angular") or {}
    (vx, vy, vz), (wx, wy, wz) = (
        [_number(vector.get(axis)) for axis in "xyz"] for vector in (linear, angular)
    )
    return Twist(vx, vy, wz, vz, wx, wy)


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) else math.nan
