"""A robot's side of a rosbridge that records each received message and its time."""

import asyncio
import contextlib
import json
import threading
import time

from bridge_notes import BridgeMessage, Noting
from websockets.asyncio.server import serve
from websockets.exceptions import ConnectionClosed


class FakeRobot(Noting):
    """Serves in a thread, so that a test may block; used as a context manager.

    It sends each message that is published on a topic to the subscribers of the topic,
    and odometry at 20 Hz to the subscribers of ``/odom``.

    Args:
        port: The port on which it listens; 0 lets the kernel choose.
        answers_services: Whether calls are answered.

    """

    def __init__(self, port=0, *, answers_services=True):
        self.received = []
        self._port = port
        self.answers_services = answers_services
        self.sends_odometry = True
        self.at_rest = False
        """Whether its odometry reports zero velocity."""
        self.deaf = threading.Event()
        """While set, the robot reads nothing from any link."""
        self._links = 0
        self._sockets = {}
        self._ready = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._run()))

    def __enter__(self):
        self._thread.start()
        assert self._ready.wait(10)
        return self

    def __exit__(self, *_):
        self.deaf.clear()
        self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join(10)

    @property
    def url(self):
        return f"ws://127.0.0.1:{self._port}"

    async def _run(self):
        self._loop, self._end = asyncio.get_running_loop(), asyncio.Event()
        server = await serve(
            self._serve,
            "127.0.0.1",
            self._port,
            compression=None,
            ping_interval=None,
        )
        self._port = server.sockets[0].getsockname()[1]
        beating = asyncio.create_task(self._odometry())
        self._ready.set()
        await self._end.wait()
        beating.cancel()
        server.close()
        await server.wait_closed()

    async def _serve(self, socket):
        self._links += 1
        link, topics = self._links, set()
        self._sockets[link] = (socket, topics)
        try:
            async for frame in socket:
                message = json.loads(frame)
                self.received.append(BridgeMessage(time.monotonic(), link, message))
                await self._answer(socket, topics, message)
        except Exception:
            pass
        finally:
            del self._sockets[link]

    async def _answer(self, socket, topics, message):
        match message["op"]:
            case "subscribe":
                topics.add(message["topic"])
            case "unsubscribe":
                topics.discard(message["topic"])
            case "publish":
                frame = json.dumps(message)
                for other, wanted in list(self._sockets.values()):
                    if message["topic"] in wanted:
                        await other.send(frame)
            case "call_service" if self.answers_services:
                answer = {"op": "service_response", "id": message["id"]}
                await socket.send(json.dumps({**answer, "values": {}, "result": True}))

    async def _odometry(self):
        twist = {"linear": {"x": 0.125, "y": 0.0}, "angular": {"z": None}}
        rest = {"linear": {"x": 0.0, "y": 0.0}, "angular": {"z": 0.0}}
        good = {"linear": {"x": 0.125, "y": 0.0}, "angular": {"z": -0.5}}
        for n in range(10**9):
            await asyncio.sleep(0.05)
            velocity = twist if n == 0 else rest if self.at_rest else good
            message = {"header": {}, "twist": {"twist": velocity, "covariance": []}}
            text = json.dumps({"op": "publish", "topic": "/odom", "msg": message})
            for socket, topics in list(self._sockets.values()):
                if "/odom" in topics and self.sends_odometry:
                    with contextlib.suppress(ConnectionClosed):  # its gate was killed
                        await socket.send(text)

    # For tests.

    def send(self, link, message):
        """Send a message to one link of the gate."""
        text = message if isinstance(message, str) else json.dumps(message)
        socket, _ = self._sockets[link]
        asyncio.run_coroutine_threadsafe(socket.send(text), self._loop).result(5)

    def cut_all(self):
        """Drop every link without a close frame."""

        def cut():
            for socket, _ in list(self._sockets.values()):
                socket.transport.abort()

        self._loop.call_soon_threadsafe(cut)

    def cut(self, link):
        """Drop one link without a close frame."""
        socket, _ = self._sockets[link]
        self._loop.call_soon_threadsafe(socket.transport.abort)

    def hold(self):
        """Stop reading, like a robot behind a stalled network."""
        self._each(lambda transport: transport.pause_reading())

    def go_on(self):
        """Read again."""
        self._each(lambda transport: transport.resume_reading())

    def _each(self, do):
        def work():
            for socket, _ in list(self._sockets.values()):
                do(socket.transport)

        self._loop.call_soon_threadsafe(work)

    @property
    def velocities(self):
        """The velocities published on ``/cmd_vel``: (time, forward speed)."""
        found = []
        for seen in self.of("publish", "/cmd_vel"):
            message = seen.message["msg"]
            twist = message.get("twist", message)
            found.append((seen.at, twist["linear"]["x"]))
        return found

    @property
    def moving(self):
        return [(at, vx) for at, vx in self.velocities if vx]

    @property
    def last_speed(self):
        return self.velocities[-1][1] if self.velocities else None
