"""A page's server and a fake of the gate, as far as ``/drive`` goes, in a thread."""

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
    """Grants every lease, accepts every command and notes all with the time."""

    def __init__(self) -> None:
        self.said: list[tuple[float, dict]] = []
        self.robots = {id: self._robot(id) for id in ("r1", "r2")}
        self.ticking = True
        self.acking = True
        self.latching = False
        """Whether STOP latches, as it does at a gate that is not of the first kind."""
        self.deaf = False
        """Whether what is said is noted and not obeyed."""
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
        """Report a robot anew to every page."""
        self.robots[robot] |= fields
        self._loop.call_soon_threadsafe(self._tell_all, dict(self.robots[robot]))

    def refuse(self, robot: str, what: str, why: str) -> None:
        """Refuse something to every page."""
        refused = {"op": "refused", "robot": robot, "what": what, "why": why}
        self._loop.call_soon_threadsafe(self._tell_all, refused)

    def drop(self) -> None:
        """Cut every connection."""
        for socket in list(self._open):
            self._loop.call_soon_threadsafe(socket.transport.abort)

    def greet(self) -> None:
        """Say what a gate says that was started anew: nobody holds anything."""
        self.robots = {id: self._robot(id) for id in self.robots}
        hello = {"op": "hello", "connection": "c1"}
        for message in (hello, *self.robots.values()):
            self._loop.call_soon_threadsafe(self._tell_all, dict(message))
        for state in self._states:
            state["ack"] = -1

    def of(self, op: str, since: float = 0.0) -> list[dict]:
        """Return what was said of one kind, after a moment."""
        return [said for at, said in self.said if said["op"] == op and at > since]

    def moves(self, since: float = 0.0) -> list[dict]:
        drives = self.of("drive", since)
        return [said for said in drives if said["x"] or said["y"] or said["turn"]]

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
            await self._say(socket, {"op": "hello", "connection": "c1"})
            for robot in self.robots:
                self.robots[robot] |= self._free()
                await self._say(socket, self.robots[robot])
            async for text in socket:
                said = json.loads(text)
                self.said.append((time.monotonic(), said))
                if not self.deaf:
                    await self._obey(socket, said, state)
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
                await self._say(
                    socket, {"op": "tick", "tick": tick, "ack": state["ack"]}
                )
            await asyncio.sleep(0.05)

    async def _obey(self, socket: ServerConnection, said: dict, state: dict) -> None:
        robot = self.robots.get(said["robot"])
        match said["op"]:
            case "take":
                self._epoch += 1
                state["neutral"] = 0
                robot |= {"holder": {"connection": "c1", "name": "me"}, "mine": True}
                robot |= {"epoch": self._epoch, "state": "held", "armed": False}
            case "release" | "stop":
                for one in [robot] if robot else self.robots.values():
                    one |= self._free()
                    if self.latching and said["op"] == "stop":
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
                await self._drive(socket, robot, said, state)
            case "goal":
                state["ack"] = said["seq"]
        for one in [said["robot"]] if robot else self.robots:
            if said["op"] not in ("drive", "goal"):
                await self._say(socket, self.robots[one])

    async def _drive(
        self, socket: ServerConnection, robot: dict, said: dict, state: dict
    ) -> None:
        if self.acking:
            state["ack"] = said["seq"]
        moving = any(said[axis] for axis in ("x", "y", "turn"))
        state["neutral"] = 0 if moving else state["neutral"] + 1
        armed = robot["armed"] or state["neutral"] >= 5
        now = "driving" if moving else "held"
        if (armed, now) != (robot["armed"], robot["state"]):
            robot |= {"armed": armed, "state": now}
            await self._say(socket, robot)

    @staticmethod
    def _free() -> dict:
        nobody = {"holder": None, "mine": False, "epoch": None}
        return nobody | {"armed": False, "state": "free"}

    def _stopped(self) -> dict:
        self._presses += 1
        stop = {"by": "me", "confirmed": None, "why": "", "id": f"s{self._presses}"}
        words = {"armable": False, "reason": "stopped by me"}
        return words | {"state": "stopped", "latched": True, "stop": stop}

    def _tell_all(self, message: dict) -> None:
        for socket in self._open:
            task = asyncio.ensure_future(self._say(socket, message))
            task.add_done_callback(lambda task: task.exception())

    @staticmethod
    async def _say(socket: ServerConnection, message: dict) -> None:
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
