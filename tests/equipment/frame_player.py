"""Plays frames that were captured from a real rosbridge, byte for byte.

``python -m equipment.frame_player FILE...``, in the folder of the tests, serves files
with one frame each: ``*.json`` with a publication or the response of a service,
``*.bin`` with a publication as CBOR. Clients get the frames of the topics that they
subscribe to, at a fixed rate, and the answers of rosapi that were captured with the
frames. The player ignores all other operations, as the captured servers do.
"""

import argparse
import asyncio
import contextlib
import json
import logging
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cbor2
import msgspec
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from webmap.base.errors import ConfigError
from webmap.base.logs import set_up_logging
from webmap.base.text import one_line
from webmap.sim.process import signals_set

log = logging.getLogger("webmap.sim")

_LATCHED = ("/map", "/tf_static")
_ROSAPI = "/rosapi/"


@dataclass(slots=True)
class Recording:
    """The frames that are played."""

    texts: dict[str, str] = field(default_factory=dict)
    """A publication of each topic, as it was captured."""

    binaries: dict[tuple[str, str], bytes] = field(default_factory=dict)
    """Binary publications by topic and compression, if they were captured."""

    answers: dict[str, Any] = field(default_factory=dict)
    """The values of rosapi's responses, by service."""

    @property
    def types(self) -> dict[str, str]:
        """The type of each topic that rosapi named."""
        topics = self.answers.get("/rosapi/topics", {"topics": [], "types": []})
        return dict(zip(topics["topics"], topics["types"], strict=True))


def load_recording(files: Iterable[Path]) -> Recording:
    """Return the frames of files; if two are of the same topic, only the first.

    Raises:
        ConfigError: If there is no publication among them.

    """
    recording = Recording()
    for path in files:
        if path.suffix == ".bin":
            _add_binary(recording, path.read_bytes())
        else:
            _add_text(recording, path.read_text(encoding="utf-8"))
    if not recording.texts:
        raise ConfigError("no captured publications among the files")
    for robot, pose in _recorded_poses(recording).items():
        _copy_messages(recording, robot, pose)
    return recording


def _add_text(recording: Recording, text: str) -> None:
    operation = _operation(text)
    if operation.get("op") == "publish":
        recording.texts.setdefault(operation["topic"], text)
    elif operation.get("op") == "service_response" and operation["result"] is True:
        recording.answers.setdefault(operation["service"], operation["values"])


def _operation(text: str) -> dict[str, Any]:
    """Return the operation in a file; an empty dict if the file has no frame."""
    try:
        # Not msgspec: a real server writes the token NaN, which is not JSON.
        operation = json.loads(text)
    except ValueError:
        return {}
    return operation if isinstance(operation, dict) else {}


def _add_binary(recording: Recording, frame: bytes) -> None:
    if not frame:
        return  # the server sent no frame, and the empty file shows this
    operation = cbor2.loads(frame)
    is_raw = set(operation["msg"]) == {"secs", "nsecs", "bytes"}
    key = (operation["topic"], "cbor-raw" if is_raw else "cbor")
    recording.binaries.setdefault(key, frame)


def _recorded_poses(recording: Recording) -> dict[str, dict[str, Any]]:
    """Return the pose of each robot in its odometry frame, from ``/tf``."""
    frame = recording.texts.get("/tf")
    transforms = json.loads(frame)["msg"]["transforms"] if frame else []
    poses = {}
    for transform in transforms:
        robot, _, child = transform["child_frame_id"].partition("/")
        if child == "base_link":
            at = transform["transform"]
            pose = {"position": at["translation"], "orientation": at["rotation"]}
            poses[robot] = pose
    return poses


def _copy_messages(recording: Recording, robot: str, pose: dict[str, Any]) -> None:
    """Copy the messages of the recorded robot to a robot with frames in ``/tf`` only.

    The copies have the name of this robot, and the odometry has the pose of this robot.
    """
    recorded = "robot_0"
    if len(robot) != len(recorded) or f"/{robot}/odom" in recording.texts:
        return
    old, new = recorded.encode(), robot.encode()
    for topic, text in tuple(recording.texts.items()):
        if topic.startswith(f"/{recorded}/"):
            text = _with_pose(text.replace(recorded, robot), pose)
            recording.texts[topic.replace(recorded, robot)] = text
    for (topic, compression), frame in tuple(recording.binaries.items()):
        if topic.startswith(f"/{recorded}/") and not topic.endswith("/odom"):
            key = (topic.replace(recorded, robot), compression)
            recording.binaries[key] = frame.replace(old, new)


def _with_pose(text: str, pose: dict[str, Any]) -> str:
    operation = json.loads(text)
    if "covariance" not in (operation["msg"].get("pose") or ()):
        return text
    operation["msg"]["pose"]["pose"] = pose
    # The recorded servers write JSON in this form.
    return json.dumps(operation, separators=(",", ":")).replace("/", "\\/")


class Player:
    """Answers the frames of one client from a recording; it has no socket."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._subscribed: dict[str, str] = {}
        self._fresh: set[str] = set()

    def receive(self, data: str | bytes) -> list[str]:
        """Return the answers to a frame of the client."""
        try:
            operation = json.loads(data)
        except ValueError:
            return []
        if not isinstance(operation, dict):
            return []
        name, topic = operation.get("op"), operation.get("topic")
        if name == "subscribe" and isinstance(topic, str):
            self._subscribed[topic] = str(operation.get("compression") or "none")
            self._fresh.add(topic)
        elif name == "unsubscribe" and isinstance(topic, str):
            self._subscribed.pop(topic, None)
        elif name == "call_service":
            return [self._answer(operation)]
        return []

    def due(self) -> list[str | bytes]:
        """Return the frames to send now; latched ones once for each subscription."""
        frames = []
        for topic, compression in self._subscribed.items():
            if topic in _LATCHED and topic not in self._fresh:
                continue
            key = (topic, compression)
            frame = self._recording.binaries.get(key, self._recording.texts.get(topic))
            if frame is not None:
                frames.append(frame)
        self._fresh.clear()
        return frames

    def _answer(self, call: dict[str, Any]) -> str:
        service = str(call.get("service", ""))
        values = self._values("/" + service.lstrip("/"), call.get("args"))
        found = values is not None
        response = {
            "op": "service_response",
            "service": service,
            "values": values if found else f"Service {service} does not exist",
            "result": found,
        }
        if "id" in call:
            response["id"] = call["id"]
        return msgspec.json.encode(response).decode()

    def _values(self, service: str, args: Any) -> Any:
        types = self._recording.types
        args = args if isinstance(args, dict) else {}
        if service == f"{_ROSAPI}topic_type":
            return {"type": types.get(args.get("topic", ""), "")}
        if service == f"{_ROSAPI}topics_for_type":
            type = args.get("type")
            return {"topics": [name for name, kind in types.items() if kind == type]}
        return self._recording.answers.get(service)


async def play(
    files: Iterable[Path],
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    rate: float = 10.0,
    on_ready: Callable[[str], None] | None = None,
    stop: asyncio.Event | None = None,
) -> None:
    """Serve a recording until SIGINT, SIGTERM, or ``stop`` is set.

    Args:
        files: With one captured frame each.
        host: The address to listen on.
        port: To listen on; 0 lets the kernel choose.
        rate: Frames of each topic a second.
        on_ready: Called with the URL once clients can connect.
        stop: Ends the run when it is set.

    Raises:
        ConfigError: If there is no publication among them.
        OSError: If the port is in use.

    """
    recording = load_recording(files)
    stop = stop or asyncio.Event()

    async def serve_client(connection: ServerConnection) -> None:
        player = Player(recording)
        sender = asyncio.create_task(_send_due(connection, player, 1 / rate))
        try:
            with contextlib.suppress(ConnectionClosed):
                async for data in connection:
                    for answer in player.receive(data):
                        await connection.send(answer)
        finally:
            sender.cancel()

    with signals_set(stop):
        server = await serve(
            serve_client, host, port, compression=None, ping_interval=None
        )
        async with server:
            if on_ready:
                on_ready(f"ws://{host}:{server.sockets[0].getsockname()[1]}")
            await stop.wait()


async def _send_due(
    connection: ServerConnection, player: Player, period: float
) -> None:
    with contextlib.suppress(ConnectionClosed):
        while True:
            for frame in player.due():
                await connection.send(frame)
            await asyncio.sleep(period)


def main() -> int:
    """Run the player and return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m equipment.frame_player")
    parser.add_argument("files", type=Path, nargs="+", help="with one frame each")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--rate", type=float, default=10.0, help="frames a second")
    options = vars(parser.parse_args())
    set_up_logging()

    def print_ready(url: str) -> None:
        print(f"rosbridge is ready at {url}", flush=True)

    try:
        asyncio.run(play(**options, on_ready=print_ready))
    except (ConfigError, OSError) as error:
        print(f"error: {one_line(error)}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
