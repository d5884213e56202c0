"""A server of a page and a fake gate for ``/drive``, in a thread."""

import asyncio
import json
import mimetypes
import threading
import time
from http import HTTPStatus
from pathlib import Path
from urllib.parse import urlsplit

from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

HERE = Path(__file__).parent
PACKAGE = HERE.parents[1] / "src" / "webmap"
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data:; require-trusted-types-for 'script'"
)


class FakeDrive:
    """Grants every lease, accepts every command and records all with the time."""

    def __init__(self) -> None:
        self.received: list[tuple[float, dict]] = []
        self.robots = {id: self._robot(id) for id in ("r1", "r2")}
        self.ticking = True
        self.acking = True
        self.latching = False
        """Whether STOP latches."""
        self.ignores_messages = False
        """Whether messages are recorded and not processed."""
        self.port = 0
        self._epoch = 40
        self._presses = 0
        self._open: list[ServerConnection] = []
        self._states: list[dict] = []
        self._ended = asyncio.Event()
        self._started = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._run()))

    def __enter__(self) -> "FakeDrive":
        self._thread.start()
        assert self._started.wait(10)
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join(10)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}/"

    def change(self, robot: str, **fields: object) -> None:
        """Change a robot and send its report to every page."""
        self.robots[robot] |= fields
        self._loop.call_soon_threadsafe(self._send_all, dict(self.robots[robot]))

    def refuse(self, robot: str, what: str, why: str) -> None:
        """Send a refusal to every page."""
        refused = {"op": "refused", "robot": robot, "what": what, "why": why}
        self._loop.call_soon_threadsafe(self._send_all, refused)

    def drop(self) -> None:
        """Cut every connection."""
        for socket in list(self._open):
            self._loop.call_soon_threadsafe(socket.transport.abort)

    def greet(self) -> None:
        """Send what a restarted gate sends: no operator has control."""
        self.robots = {id: self._robot(id) for id in self.robots}
        hello = {"op": "hello", "connection": "c1"}
        for message in (hello, *self.robots.values()):
            self._loop.call_soon_threadsafe(self._send_all, dict(message))
        for state in self._states:
            state["ack"] = -1

    def of(self, op: str, since: float = 0.0) -> list[dict]:
        """Return the messages with an operation, received after a time."""
        return [
            message
            for at, message in self.received
            if message["op"] == op and at > since
        ]

    def moves(self, since: float = 0.0) -> list[dict]:
        drives = self.of("drive", since)
        return [
            message
            for message in drives
            if message["x"] or message["y"] or message["turn"]
        ]

    @staticmethod
    def _robot(id: str) -> dict:
        return {
            "op": "robot", "robot": id, "name": f"Robot {id}", "state": "free",
            "holder": None, "mine": False, "epoch": None, "armed": False, "v": 0.3,
            "w": 0.6, "why": ["stop not verified"], "link": "up", "sent": [0, 0, 0],
            "echoed": None, "measured": [0, 0, 0], "armable": True, "reason": None,
        }  # fmt: skip

    async def _run(self) -> None:
        self._loop = asyncio.get_running_loop()
        async with serve(
            self._serve,
            "127.0.0.1",
            0,
            subprotocols=["webmap"],
            process_request=self._file,
            close_timeout=0.1,
        ) as server:
            self.port = server.sockets[0].getsockname()[1]
            self._started.set()
            await self._ended.wait()

    def _file(self, socket: ServerConnection, request: Request) -> Response | None:
        path = urlsplit(request.path).path
        if path == "/_webmap/drive":
            return None
        ours = path.startswith("/_webmap/")
        name = path.removeprefix("/_webmap/") if ours else path.strip("/")
        file = (PACKAGE if ours else HERE / "hands_page") / (name or "index.html")
        if not file.is_file():
            return socket.respond(HTTPStatus.NOT_FOUND, f"no {path}\n")
        kind = mimetypes.guess_type(file.name)[0] or "application/octet-stream"
        body = file.read_bytes()
        headers = Headers({"Content-Type": kind, "Content-Length": str(len(body))})
        headers["Content-Security-Policy"] = POLICY
        headers["Cache-Control"] = "no-store"
        return Response(200, "OK", headers, body)

    async def _serve(self, socket: ServerConnection) -> None:
        self._open.append(socket)
        state = {"ack": -1, "neutral": 0}
        self._states.append(state)
        ticker = asyncio.create_task(self._tick(socket, state))
        try:
            await self._send(socket, {"op": "hello", "connection": "c1"})
            for robot in self.robots:
                self.robots[robot] |= self._free()
                await self._send(socket, self.robots[robot])
            async for text in socket:
                message = json.loads(text)
                self.received.append((time.monotonic(), message))
                if not self.ignores_messages:
                    await self._process(socket, message, state)
        except ConnectionClosed:
            pass
        finally:
            ticker.cancel()
            self._open.remove(socket)

    async def _tick(self, socket: ServerConnection, state: dict) -> None:
        tick = 5000
        while True:
            if self.ticking:
                tick += 1
                await self._send(
                    socket, {"op": "tick", "tick": tick, "ack": state["ack"]}
                )
            await asyncio.sleep(0.05)

    async def _process(
        self, socket: ServerConnection, message: dict, state: dict
    ) -> None:
        robot = self.robots.get(message["robot"])
        match message["op"]:
            case "take":
                self._epoch += 1
                state["neutral"] = 0
                robot |= {"holder": {"connection": "c1", "name": "me"}, "mine": True}
                robot |= {"epoch": self._epoch, "state": "held", "armed": False}
            case "release" | "stop":
                for one in [robot] if robot else self.robots.values():
                    one |= self._free()
                    if self.latching and message["op"] == "stop":
                        one |= self._stopped()
            case "reset":
                for one in [robot] if robot else self.robots.values():
                    one |= {"state": "free", "latched": False, "stop": None}
                    one |= {"armable": True, "reason": None}
            case "ask":
                asker = {"connection": "c1", "name": "me", "left": 8.0}
                robot |= {"asker": asker}
            case "grant":
                robot |= self._free()
                robot |= {"holder": robot["asker"], "asker": None, "state": "held"}
            case "deny":
                robot |= {"asker": None}
            case "drive":
                await self._drive(socket, robot, message, state)
            case "goal":
                state["ack"] = message["seq"]
        for one in [message["robot"]] if robot else self.robots:
            if message["op"] not in ("drive", "goal"):
                await self._send(socket, self.robots[one])

    async def _drive(
        self, socket: ServerConnection, robot: dict, message: dict, state: dict
    ) -> None:
        if self.acking:
            state["ack"] = message["seq"]
        moving = any(message[axis] for axis in ("x", "y", "turn"))
        state["neutral"] = 0 if moving else state["neutral"] + 1
        armed = robot["armed"] or state["neutral"] >= 5
        now = "driving" if moving else "held"
        if (armed, now) != (robot["armed"], robot["state"]):
            robot |= {"armed": armed, "state": now}
            await self._send(socket, robot)

    @staticmethod
    def _free() -> dict:
        without_operator = {"holder": None, "mine": False, "epoch": None}
        return without_operator | {"armed": False, "state": "free"}

    def _stopped(self) -> dict:
        self._presses += 1
        stop = {"by": "me", "confirmed": None, "why": "", "id": f"s{self._presses}"}
        blocked = {"armable": False, "reason": "stopped by me"}
        return blocked | {"state": "stopped", "latched": True, "stop": stop}

    def _send_all(self, message: dict) -> None:
        for socket in self._open:
            task = asyncio.ensure_future(self._send(socket, message))
            task.add_done_callback(lambda task: task.exception())

    @staticmethod
    async def _send(socket: ServerConnection, message: dict) -> None:
        if message["op"] == "robot":
            message = {"doing": _doing(message), **message}
        await socket.send(json.dumps(message))


def _doing(robot: dict) -> str:
    """Return what a robot does, as the gate reports it."""
    if robot.get("changing"):
        return "changing"
    if robot["state"] == "stopped":
        confirmed = (robot.get("stop") or {}).get("confirmed")
        return "unconfirmed" if confirmed is False else "stopped"
    if robot["state"] == "free":
        return "free" if robot["armable"] else "barred"
    if robot["state"] == "held":
        return "held" if robot["reason"] is None else "barred_held"
    return "driven" if robot["state"] == "driving" else robot["state"]
