"""The cameras over HTTP beside an agent: fetched while a display looks at them.

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

from webmap.agents import address, looks
from webmap.agents.address import Sender, sender_of
from webmap.agents.allowance import Allowance
from webmap.agents.looks import CameraPicture, Look, LookAway, Looked
from webmap.agents.peer import Peer
from webmap.base.errors import ProtocolError, WireError
from webmap.config.robot import RobotConfig, named_cameras
from webmap.ros.image_address import parse_address
from webmap.ros.image_pull import Pull
from webmap.ros.messages_image import CompressedImageMsg

log = logging.getLogger("webmap.agent")

LOOKED = 5.0
"""Seconds after the last look of a display after which a camera is not fetched."""

AHEAD = 2
"""Pictures that may be on their way while no display has got them."""

PATIENCE = 3.0
"""Seconds after which a picture that no display has got counts as lost."""

MOST_DISPLAYS = 100
"""Displays of one user that look at one camera at once."""

THROTTLE = 200
"""The least milliseconds between two pictures, if the configuration states none."""

Name: TypeAlias = tuple[str, str]
"""The id of a robot and the name of one of its cameras."""


class HeldCamera(NamedTuple):
    """A camera of the agent's own configuration."""

    url: str
    throttle: int
    """The least time between two pictures, in milliseconds."""


def cameras_in(robots: Iterable[tuple[str, RobotConfig]]) -> dict[Name, HeldCamera]:
    """Return the cameras over HTTP of robots, given with their ids."""
    return {
        (id, camera.name): HeldCamera(
            camera.url, THROTTLE if camera.throttle is None else camera.throttle
        )
        for id, config in robots
        for camera in named_cameras(config.cameras)
        if camera.url
    }


@dataclass
class _Watched:
    """A camera at which displays look."""

    camera: HeldCamera
    looks: dict[Sender, float] = field(default_factory=dict)
    """When each display looked last."""
    newest: tuple[bytes, float] | None = None
    """The picture to send next, and when it came."""
    flying: deque[tuple[int, float]] = field(default_factory=deque)
    """Numbers and times of sent pictures that no display has got yet."""
    trouble: str = ""


class Cameras:
    """Decides which cameras are fetched, and which pictures are sent. No I/O.

    Args:
        begin: Begins to fetch a camera.
        end: Ends to fetch a camera.
        send: Sends a picture of a camera to all displays.
        answer: Answers a look of one display.

    """

    def __init__(
        self,
        *,
        begin: Callable[[Name, HeldCamera], None],
        end: Callable[[Name], None],
        send: Callable[[Name, CameraPicture], None],
        answer: Callable[[Sender, Looked], None],
    ) -> None:
        self._begin = begin
        self._end = end
        self._send = send
        self._answer = answer
        self._held: dict[Name, HeldCamera] = {}
        self._watched: dict[Name, _Watched] = {}
        self._numbers = secrets.randbits(32) + 1

    def hold(self, cameras: Mapping[Name, HeldCamera]) -> None:
        """Set the cameras that displays may look at."""
        self._held = dict(cameras)
        for name, watched in list(self._watched.items()):
            if self._held.get(name) != watched.camera:
                self._forget(name)

    def receive(self, client: Sender, look: Look | LookAway, now: float) -> None:
        """Process a message of a display about a camera.

        Raises:
            WireError: If too many displays look at the camera.

        """
        name = (look.robot, look.camera)
        if isinstance(look, LookAway):
            self._look_away(name, client)
            return
        camera = self._held.get(name)
        if camera is None:
            text = "the agent has no such camera"
            self._answer(client, Looked(look.number, now, text))
            return
        watched = self._watched.get(name)
        if watched is None:
            watched = self._watched[name] = _Watched(camera)
            self._begin(name, camera)
        elif client not in watched.looks:
            mine = [each for each in watched.looks if each.user == client.user]
            if len(mine) >= MOST_DISPLAYS:
                raise WireError(
                    f"more than {MOST_DISPLAYS} displays of the user {client.user} "
                    "look at one camera"
                )
        watched.looks[client] = now
        self._answer(client, Looked(look.number, now, watched.trouble))
        if any(number == look.newest for number, _ in watched.flying):
            while watched.flying.popleft()[0] != look.newest:
                pass
        self._send_newest(name, watched, now)

    def picture(self, name: Name, data: bytes, now: float) -> None:
        """Note a picture that came from a camera."""
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
        """Note why no pictures come from a camera; displays read it after a look."""
        watched = self._watched.get(name)
        if watched is not None:
            watched.trouble = text

    def look(self, now: float) -> None:
        """End the cameras that no display looks at any more."""
        for name, watched in list(self._watched.items()):
            for client, at in list(watched.looks.items()):
                if now - at > LOOKED:
                    self._look_away(name, client)

    def _look_away(self, name: Name, client: Sender) -> None:
        watched = self._watched.get(name)
        if watched is None or watched.looks.pop(client, None) is None:
            return
        if not watched.looks:
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
        self._send(name, CameraPicture(self._numbers, came, data))


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
        self._allowance = Allowance("looks at cameras")
        self._cameras = Cameras(
            begin=self._begin, end=self._end, send=self._send, answer=self._answer
        )

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to listen to displays; called in the loop's thread."""
        self._loop = loop
        every = address.EVERY
        self._peer.listen(
            address.looks_in(self._agent, every, every),
            self._arrived,
            most=looks.MOST_OF_LOOK,
        )

    async def stop(self) -> None:
        """End all downloads."""
        for pull in self._pulls.values():
            await pull.stop()

    def hold(self, robots: Iterable[tuple[str, RobotConfig]]) -> None:
        """Set the robots, with their ids, whose cameras displays may look at."""
        self._cameras.hold(cameras_in(robots))

    def look(self, now: float) -> None:
        """End the cameras that no display looks at any more."""
        self._cameras.look(now)

    def _arrived(self, key: str, piece: bytes) -> None:
        client = sender_of(key)
        if (
            self._loop is not None
            and not self._loop.is_closed()
            and self._allowance.admits(client.user, len(piece), time.monotonic())
        ):
            self._loop.call_soon_threadsafe(self._take, client, piece)

    def _take(self, client: Sender, piece: bytes) -> None:
        try:
            self._cameras.receive(client, looks.read_look(piece), time.monotonic())
        except WireError as error:
            log.warning("display %s: %s", client.display, error)

    def _begin(self, name: Name, camera: HeldCamera) -> None:
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

    def _send(self, name: Name, picture: CameraPicture) -> None:
        key = address.camera_key(self._agent, *name)
        self._peer.put_data(key, looks.pack_picture(picture))

    def _answer(self, client: Sender, looked: Looked) -> None:
        key = address.looks_out(self._agent, client.user, client.instance)
        self._peer.put_data(key, msgspec.json.encode(looked), all=True)
