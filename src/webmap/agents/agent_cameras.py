"""The cameras over HTTP beside an agent: fetched while a display shows them.

The agent fetches only the cameras of its own configuration, and each once for all
displays. Of the pictures that a slow link cannot carry, the older ones are left out.
"""

import asyncio
import logging
import secrets
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

import msgspec

from webmap.agents import address, camera_messages
from webmap.agents.address import Sender
from webmap.agents.camera_messages import (
    CameraRelease,
    CameraReply,
    CameraRequest,
    PictureMessage,
)
from webmap.agents.peer import Peer
from webmap.agents.rate_limit import Receiver
from webmap.base.errors import ProtocolError, WireError
from webmap.config.robot import RobotConfig, named_cameras
from webmap.ros.image_address import parse_address
from webmap.ros.image_pull import Pull
from webmap.ros.messages_image import CompressedImageMsg

log = logging.getLogger("webmap.agent")

EXPIRY = 5.0
"""Seconds after the last request of a display after which a camera is not fetched."""

AHEAD = 2
"""Pictures that may be on their way while no display has got them."""

PATIENCE = 3.0
"""Seconds after which a picture that no display has got counts as lost."""

MOST_DISPLAYS = 100
"""Displays of one user that show one camera at once."""

THROTTLE = 200
"""The least milliseconds between two pictures, if the configuration states none."""

Name: TypeAlias = tuple[str, str]
"""The id of a robot and the name of one of its cameras."""


class CameraSource(NamedTuple):
    """A camera of the agent's own configuration."""

    url: str
    throttle: int
    """The least time between two pictures, in milliseconds."""


def cameras_of(robots: Iterable[tuple[str, RobotConfig]]) -> dict[Name, CameraSource]:
    """Return the cameras over HTTP of robots, given with their ids."""
    return {
        (id, camera.name): CameraSource(
            camera.url, THROTTLE if camera.throttle is None else camera.throttle
        )
        for id, config in robots
        for camera in named_cameras(config.cameras)
        if camera.url
    }


@dataclass
class _Watched:
    """A camera that displays show."""

    camera: CameraSource
    requests: dict[Sender, float] = field(default_factory=dict)
    """When the last request of each display came."""
    newest: tuple[bytes, float] | None = None
    """The picture to send next, and when it came."""
    flying: deque[tuple[int, float]] = field(default_factory=deque)
    """Numbers and times of sent pictures that no display has got yet."""
    trouble: str = ""


class CameraRelay:
    """Decides which cameras are fetched, and which pictures are sent. No I/O.

    Args:
        begin: Begins to fetch a camera.
        end: Ends to fetch a camera.
        send: Sends a picture of a camera to all displays.
        answer: Answers a request of one display.

    """

    def __init__(
        self,
        *,
        begin: Callable[[Name, CameraSource], None],
        end: Callable[[Name], None],
        send: Callable[[Name, PictureMessage], None],
        answer: Callable[[Sender, CameraReply], None],
    ) -> None:
        self._begin = begin
        self._end = end
        self._send = send
        self._answer = answer
        self._sources: dict[Name, CameraSource] = {}
        self._watched: dict[Name, _Watched] = {}
        self._numbers = secrets.randbits(32) + 1

    def set_cameras(self, cameras: Mapping[Name, CameraSource]) -> None:
        """Set the cameras that displays may show."""
        self._sources = dict(cameras)
        for name, watched in list(self._watched.items()):
            if self._sources.get(name) != watched.camera:
                self._forget(name)

    def receive(
        self, client: Sender, request: CameraRequest | CameraRelease, now: float
    ) -> None:
        """Process a message of a display about a camera.

        Raises:
            WireError: If too many displays show the camera.

        """
        name = (request.robot, request.camera)
        if isinstance(request, CameraRelease):
            self._leave(name, client)
            return
        camera = self._sources.get(name)
        if camera is None:
            text = "the agent has no such camera"
            self._answer(client, CameraReply(request.number, now, text))
            return
        watched = self._watched.get(name)
        if watched is None:
            watched = self._watched[name] = _Watched(camera)
            self._begin(name, camera)
        elif client not in watched.requests:
            mine = [each for each in watched.requests if each.user == client.user]
            if len(mine) >= MOST_DISPLAYS:
                raise WireError(
                    f"more than {MOST_DISPLAYS} displays of the user {client.user} "
                    "look at one camera"
                )
        watched.requests[client] = now
        self._answer(client, CameraReply(request.number, now, watched.trouble))
        if any(number == request.newest for number, _ in watched.flying):
            while watched.flying.popleft()[0] != request.newest:
                pass
        self._send_newest(name, watched, now)

    def picture(self, name: Name, data: bytes, now: float) -> None:
        """Send displays a picture of a camera; one of another format is a trouble."""
        watched = self._watched.get(name)
        if watched is None:
            return
        try:
            CompressedImageMsg(data).media_type  # noqa: B018  # it raises the error
        except ProtocolError as error:
            self.complain(name, f"it sends {error}")
            return
        watched.trouble = ""
        watched.newest = (data, now)
        self._send_newest(name, watched, now)

    def complain(self, name: Name, text: str) -> None:
        """Note why no pictures come from a camera, for the next answers to displays."""
        watched = self._watched.get(name)
        if watched is not None:
            watched.trouble = text

    def check(self, now: float) -> None:
        """End the cameras that no display shows any more."""
        for name, watched in list(self._watched.items()):
            for client, at in list(watched.requests.items()):
                if now - at > EXPIRY:
                    self._leave(name, client)

    def _leave(self, name: Name, client: Sender) -> None:
        watched = self._watched.get(name)
        if watched is None or watched.requests.pop(client, None) is None:
            return
        if not watched.requests:
            self._forget(name)

    def _forget(self, name: Name) -> None:
        del self._watched[name]
        self._end(name)

    def _send_newest(self, name: Name, watched: _Watched, now: float) -> None:
        flying = watched.flying
        while flying and now - flying[0][1] > PATIENCE:
            flying.popleft()
        if watched.newest is None or len(flying) >= AHEAD:
            return
        data, came = watched.newest
        watched.newest = None
        self._numbers += 1
        flying.append((self._numbers, now))
        self._send(name, PictureMessage(self._numbers, came, data))


class AgentCameras:
    """Fetches the cameras of an agent for the displays of its router.

    Args:
        agent: The name of the agent.
        peer: The sessions with the router.

    """

    def __init__(self, agent: str, peer: Peer) -> None:
        self._agent = agent
        self._peer = peer
        self._loop: asyncio.AbstractEventLoop | None = None
        self._pulls: dict[Name, Pull] = {}
        self._receiver = Receiver("camera requests", self._receive)
        self._cameras = CameraRelay(
            begin=self._begin, end=self._end, send=self._send, answer=self._answer
        )

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to listen to displays; called in the loop's thread."""
        self._loop = loop
        self._receiver.start(loop)
        every = address.EVERY
        self._peer.listen(
            address.camera_in(self._agent, every, every),
            self._receiver.receive,
            most=camera_messages.MOST_REQUEST,
        )

    async def stop(self) -> None:
        """End all downloads; called when the agent ends."""
        for pull in self._pulls.values():
            await pull.stop()

    def set_cameras(self, robots: Iterable[tuple[str, RobotConfig]]) -> None:
        """Set the robots, with their ids, whose cameras displays may show."""
        self._cameras.set_cameras(cameras_of(robots))

    def check(self, now: float) -> None:
        """End the cameras that no display shows any more."""
        self._cameras.check(now)

    def _receive(self, client: Sender, piece: bytes, now: float) -> None:
        self._cameras.receive(client, camera_messages.read_request(piece), now)

    def _begin(self, name: Name, camera: CameraSource) -> None:
        assert self._loop is not None
        pull = self._pulls[name] = Pull(
            parse_address(camera.url),
            camera.throttle / 1000,
            lambda data: self._cameras.picture(name, data, time.monotonic()),
            lambda text: self._cameras.complain(name, text),
        )
        pull.start(self._loop)

    def _end(self, name: Name) -> None:
        self._pulls.pop(name).hang_up()

    def _send(self, name: Name, picture: PictureMessage) -> None:
        key = address.camera_key(self._agent, *name)
        self._peer.put_data(key, camera_messages.pack_picture(picture))

    def _answer(self, client: Sender, reply: CameraReply) -> None:
        key = address.camera_out(self._agent, client.user, client.instance)
        self._peer.put_data(key, msgspec.json.encode(reply), all=True)
