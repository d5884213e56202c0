"""The least of a rosbridge that a robot needs to be driven, and its bad habits."""

import asyncio
import contextlib
import json
from collections.abc import Callable, Iterator
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed

Hear = Callable[[int, dict[str, Any]], None]


class Socket:
    """One WebSocket of a client."""

    def __init__(self, number: int, connection: ServerConnection) -> None:
        self.number = number
        self.connection = connection
        self.topics: dict[str, int] = {}
        """What it subscribed to, and how often."""


class WitnessBridge:
    """A rosbridge server that hands every message on before it does anything with it.

    The messages of one socket are dealt with in order, as rosbridge does it, so that
    one that hangs holds up all behind it while pings are still answered.

    Args:
        hear: Called with the number of the socket and the message.

    """

    def __init__(self, hear: Hear) -> None:
        self.answers_services = True
        """Otherwise a call hangs, and all that comes behind it on its socket."""
        self.goals_block = False
        """Whether a goal runs on its socket's input thread until it ends."""
        self.types: dict[str, str] = {}
        """The topics that rosapi tells of, with their types."""
        self.publishers: dict[str, list[str]] = {}
        """The nodes that rosapi names as publishers of a topic."""
        self.port = 0
        self._hear = hear
        self._sockets: dict[int, Socket] = {}
        self._count = 0
        self._server: Server | None = None
        self._unblocked = asyncio.Event()

    async def start(self) -> None:
        """Listen; on the port of before, if there was one."""
        self._server = await serve(
            self._serve,
            "127.0.0.1",
            self.port,
            compression=None,
            ping_interval=None,  # as rosbridge: pings are off unless asked for
            max_queue=None,  # a handler that hangs must not keep pongs from leaving
        )
        self.port = next(iter(self._server.sockets)).getsockname()[1]

    async def stop(self) -> None:
        """Drop every link without a word and listen no more."""
        if self._server is None:
            return
        server, self._server = self._server, None
        server.close(close_connections=False)
        for socket in list(self._sockets.values()):
            socket.connection.transport.abort()
        self.unblock()
        await server.wait_closed()

    def unblock(self) -> None:
        """Let what hangs go on."""
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
        socket = Socket(self._count, connection)
        self._sockets[socket.number] = socket
        try:
            async for frame in connection:
                for message in _read(frame):
                    self._hear(socket.number, message)
                    await self._obey(socket, message)
        except ConnectionClosed:
            pass
        finally:
            del self._sockets[socket.number]

    async def _obey(self, socket: Socket, message: dict[str, Any]) -> None:
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

    async def _serve_call(self, socket: Socket, message: dict[str, Any]) -> None:
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
