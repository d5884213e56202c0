"""A camera over HTTP beside an agent, as a display shows it.

The display has no address of the camera. It names the robot and the camera, and the
agent fetches the pictures.
"""

import asyncio
import contextlib
import itertools
import logging
import time
from collections.abc import Callable
from typing import NamedTuple, Self
from urllib.parse import parse_qs, urlencode, urlsplit

import msgspec

from webmap.agents import address, camera_messages
from webmap.agents.camera_messages import (
    AgentClock,
    CameraRelease,
    CameraRequest,
)
from webmap.agents.peer import Peer, peer_of
from webmap.agents.rate_limit import UserRateLimit
from webmap.base.errors import ConfigError, WireError
from webmap.base.text import one_line

log = logging.getLogger("webmap.agent")

AGAIN = 1.0
"""Seconds between two requests while no pictures come."""

PATIENCE = 5.0
"""Seconds without any answer of the agent after which that is a problem."""

_numbers = itertools.count(1)


class RemoteCamera(NamedTuple):
    """Where a camera beside an agent is."""

    agent: str
    """The address of the agent, ``zenoh://host:7447/name``."""
    robot: str
    """The id of the robot."""
    camera: str
    """The name of the camera."""
    place: str
    """The address of the camera as shown to people, without secrets."""

    @classmethod
    def parse(cls, url: str) -> Self:
        """Return the camera in an address of :attr:`url`.

        Raises:
            ConfigError: If the address names no camera of an agent.

        """
        agent, _, query = url.partition("?")
        fields = parse_qs(query)
        try:
            (robot,), (camera,) = fields["robot"], fields["camera"]
            (place,) = fields.get("place", [""])
        except (KeyError, ValueError):
            robot = camera = place = ""
        if not (robot and camera and address.agent_in(agent)):
            raise ConfigError(f"{url!r} names no robot and camera of an agent")
        return cls(agent, robot, camera, place)

    @property
    def url(self) -> str:
        """All fields in one address, which :meth:`parse` reads."""
        fields = {"robot": self.robot, "camera": self.camera, "place": self.place}
        return f"{self.agent}?{urlencode(fields)}"

    @property
    def name(self) -> str:
        """The name of the agent, without its router."""
        return urlsplit(self.agent).path.strip("/")

    @property
    def shown(self) -> str:
        """The camera's address and its agent, as shown to people."""
        return f"{self.place} through the agent {self.name}".strip()


class RemoteCameraPull:
    """Gets the pictures of a camera beside an agent; a service of the process.

    Args:
        camera: Where the camera is.
        show: Called with each picture and its greatest possible age, in seconds.
        complain: Called with the reason while no pictures come.

    """

    def __init__(
        self,
        camera: RemoteCamera,
        show: Callable[[bytes, float], None],
        complain: Callable[[str], None],
    ) -> None:
        self._camera = camera
        self._show = show
        self._complain = complain
        self._clock = AgentClock()
        self._allowance = UserRateLimit("pictures", pieces=200, size=32 << 20)
        self._newest = 0
        self._answered_at = 0.0
        self._peer: Peer | None = None
        self._listening: list[int] = []
        self._task: asyncio.Task[None] | None = None

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to request pictures."""
        agent, robot, camera = self._camera.name, *self._camera[1:3]
        self._peer = peer = peer_of(self._camera.agent)
        self._loop = loop
        user = peer.user
        self._in = address.camera_in(agent, user.name, user.instance)
        out = address.camera_out(agent, user.name, user.instance)
        self._listening = [
            peer.listen(
                out, self._later(self._take_answer), most=camera_messages.MOST_REQUEST
            ),
            peer.listen(
                address.camera_key(agent, robot, camera),
                self._later(self._take),
                most=camera_messages.MOST_PICTURE,
            ),
        ]
        self._answered_at = time.monotonic()
        self._task = loop.create_task(self._keep_requesting())

    async def stop(self) -> None:
        """Request no more pictures."""
        task = self._task
        self.hang_up()
        if task is not None:
            await asyncio.wait([task])

    def hang_up(self) -> None:
        """Request no more pictures; the second call has no effect."""
        task, self._task = self._task, None
        if task is None or self._peer is None:
            return
        task.cancel()
        for number in self._listening:
            self._peer.unlisten(number)
        self._put(CameraRelease(self._camera.robot, self._camera.camera))

    async def _keep_requesting(self) -> None:
        assert self._peer is not None
        while True:
            self._request()
            await asyncio.sleep(AGAIN)
            if time.monotonic() - self._answered_at > PATIENCE:
                self._complain(self._peer.trouble or "the agent does not answer")

    def _request(self) -> None:
        number = next(_numbers)
        self._clock.asked(number, time.monotonic())
        robot, camera = self._camera.robot, self._camera.camera
        self._put(CameraRequest(number, robot, camera, self._newest))

    def _put(self, message: CameraRequest | CameraRelease) -> None:
        assert self._peer is not None
        self._peer.put_data(self._in, msgspec.json.encode(message), all=True)

    def _later(self, fn: Callable[[bytes], None]) -> Callable[[str, bytes], None]:
        """Return a function that calls ``fn`` in the model's thread."""

        def call(_key: str, piece: bytes) -> None:
            name = self._camera.name
            if not self._allowance.admits(name, len(piece), time.monotonic()):
                return
            with contextlib.suppress(RuntimeError):  # the loop has been closed
                self._loop.call_soon_threadsafe(self._unless_ended, fn, piece)

        return call

    def _unless_ended(self, fn: Callable[[bytes], None], piece: bytes) -> None:
        if self._task is None:
            return
        try:
            fn(piece)
        except WireError as error:
            log.warning("%s: %s", self._camera.agent, error)

    def _take_answer(self, piece: bytes) -> None:
        reply, now = camera_messages.read_reply(piece), time.monotonic()
        if self._clock.answered(reply.number, reply.clock, now):
            self._answered_at = now
            if reply.trouble:
                self._complain(one_line(reply.trouble))

    def _take(self, piece: bytes) -> None:
        picture = camera_messages.read_picture(piece)
        age = self._clock.age(picture.clock, time.monotonic())
        if age is None:  # it was sent for another display
            return
        self._newest = picture.number
        self._request()
        self._show(picture.data, age)
