"""The cameras of a robot: pictures from a topic or over HTTP, for pages that watch."""

import asyncio
import io
import re
import time
from collections import deque
from collections.abc import Callable
from typing import Literal, TypeAlias

import msgspec

from webmap.agents.remote_camera import RemoteCamera, RemoteCameraPull
from webmap.base.errors import ConfigError, ProtocolError
from webmap.base.lifecycle import lifecycle
from webmap.base.scope import Removable, Removal, Scope, current_scope, keep, no_scope
from webmap.base.tasks import spawn
from webmap.core.pictures import pictures
from webmap.core.problems import draw_or_report
from webmap.core.registry import robot_modules
from webmap.core.robot import Robot
from webmap.ros.bridge import Bridge
from webmap.ros.image_address import parse_address
from webmap.ros.image_pull import Pull
from webmap.ros.messages_image import AnyImageMsg, CompressedImageMsg, ImageMsg
from webmap.ros.names import PICTURES, is_agent_url, split_type

AGE_LIMIT = 1.0
"""Seconds after which a picture is stale."""

LEAST_KEPT, MOST_KEPT = 3, 64
"""Pictures that pages may request: slow pages still request earlier ones."""

KEPT_FOR = 5.0
"""Seconds for which pictures beyond the least number are kept."""

KEPT_BYTES = 8 << 20
"""Greatest number of bytes of the pictures beyond the least number."""


class CameraFeed:
    """The newest picture of one camera, and the pages that watch it.

    A derived class starts and stops its pictures in ``begin`` and ``end``, and passes
    each to :meth:`show`. Pictures arrive only while a page watches, and once for all
    pages.

    Args:
        robot: The robot that carries the camera.
        name: The camera's name, for people.
    """

    def __init__(self, robot: Robot, name: str) -> None:
        self.robot = robot
        self.name = name
        self.url: str | None = None
        """The URL of the newest picture; None until there is one."""
        self.stamp: float | None = None
        """Time when the picture was sent, in monotonic seconds."""
        self._watchers: dict[object, Callable[[], None]] = {}
        self._kept: deque[tuple[str, float, int]] = deque()

    def begin(self) -> None:
        """Start the pictures: a page watches now."""
        raise NotImplementedError

    def end(self) -> None:
        """Stop the pictures: no page watches any more."""
        raise NotImplementedError

    def destroy(self) -> None:
        """Remove the pictures."""
        if self._watchers:
            self._watchers.clear()
            self._finish()

    @property
    def watched(self) -> bool:
        """Whether a page watches, so that pictures arrive."""
        return bool(self._watchers)

    def watch(self, fn: Callable[[], None]) -> Removable:
        """Call ``fn`` whenever there is a new picture.

        Returns:
            A handle that ends the calls; the end of the current scope ends them too.
        """
        key = object()
        first = not self._watchers
        self._watchers[key] = fn
        if first:
            # Outside the scope of the first watcher, because the pictures continue for
            # others.
            try:
                with no_scope():
                    self.begin()
            except BaseException:
                # The next watcher is the first again, and begins.
                self._watchers.pop(key, None)
                raise
        scope = current_scope()

        def undo() -> None:
            if scope is not None:
                scope.discard(watching)
            if self._watchers.pop(key, None) is not None and not self._watchers:
                self._finish()

        watching = keep(Removal(undo))
        return watching

    def show(self, data: bytes, media_type: str, lag: float = 0.0) -> None:
        """Show a picture to all watchers, in place of the last one.

        Args:
            data: The picture.
            media_type: Its type, as in ``image/jpeg``.
            lag: Seconds between sending and receiving.
        """
        # Pictures must not remain on an operator's disk.
        self.url = pictures.publish(data, media_type, fleeting=True)
        now = time.monotonic()
        self.stamp = now - lag
        kept = self._kept
        kept.append((self.url, now, len(data)))
        while len(kept) > LEAST_KEPT and (
            len(kept) > MOST_KEPT
            or now - kept[0][1] > KEPT_FOR
            or sum(size for _, _, size in kept) > KEPT_BYTES
        ):
            pictures.withdraw(kept.popleft()[0])
        for fn in tuple(self._watchers.values()):
            fn()

    def _finish(self) -> None:
        self.end()
        self.robot.clear_problem(self)
        while self._kept:
            pictures.retire(self._kept.popleft()[0])
        self.url = self.stamp = None


class TopicCamera(CameraFeed):
    """A camera that sends messages on a topic, while a page watches.

    A derived class subscribes in ``subscribe``.

    Args:
        robot: The robot that carries the camera.
        bridge: The bridge of the ROS system that has the topic.
        topic: The topic.
        name: The camera's name, for people.
    """

    def __init__(self, robot: Robot, bridge: Bridge, topic: str, name: str) -> None:
        super().__init__(robot, name)
        self.topic = topic
        self._bridge = bridge
        self._scope: Scope | None = None

    def subscribe(self) -> None:
        """Subscribe to the topic; this ends with the current scope."""
        raise NotImplementedError

    def begin(self) -> None:
        """Subscribe to the topic."""
        self._scope = Scope(
            f"camera {self.topic}", self._report, self.robot.clear_problem
        )
        with no_scope(), self._scope.active():
            self.subscribe()

    def end(self) -> None:
        """Unsubscribe."""
        scope, self._scope = self._scope, None
        if scope is not None:
            scope.close()

    def _report(self, text: str, about: object) -> None:
        if about is None:
            self.robot.report_error(text)
        else:
            self.robot.set_problem(about, text)


CameraType: TypeAlias = Literal[
    "sensor_msgs/CompressedImage",
    "sensor_msgs/Image",
    "sensor_msgs/msg/CompressedImage",
    "sensor_msgs/msg/Image",
]
"""The types of pictures, in both dialects."""

PACKED, RAW = PICTURES

JPEG = "jpeg"
"""The encoding of a large raw picture after the worker process has drawn it."""


class JpegImageMsg(ImageMsg):
    """A raw picture that is converted to JPEG if it is large."""

    def digest(self) -> ImageMsg:
        """Return the picture as JPEG; called in the worker process.

        Raises:
            ProtocolError: If its encoding or its size is not supported.
        """
        return msgspec.structs.replace(self, encoding=JPEG, data=jpeg(self))


class JpegAnyImageMsg(AnyImageMsg):
    """A picture of either type; a large raw picture is converted to JPEG."""

    def digest(self) -> AnyImageMsg:
        """Return the picture as JPEG if it is raw; called in the worker process.

        Raises:
            ProtocolError: If its encoding or its size is not supported.
        """
        if self.raw is None:
            return self
        return msgspec.structs.replace(self, encoding=JPEG, data=jpeg(self.raw))


VIEWS: dict[str | None, type[msgspec.Struct]] = {
    PACKED: CompressedImageMsg,
    RAW: JpegImageMsg,
    None: JpegAnyImageMsg,
}

PLAIN = re.compile(r"/image(?![^/]*(?:compress|jpe?g|png|webp))[^/]*\Z")
"""Names of raw pictures, by the convention of image_transport."""


@robot_modules.register
class Camera(TopicCamera):
    """Receives the newest picture of a camera, for all pages that watch it.

    The robot sends pictures only while a page watches, and once for all pages. Pages
    load them by URL: show :attr:`url` in an ``<img>``.

    Args:
        robot: The robot that carries the camera.
        bridge: The bridge of the ROS system that has the topic.
        topic: A topic of type ``sensor_msgs/CompressedImage`` (JPEG, PNG or WebP) or
            ``sensor_msgs/Image``.
        name: The camera's name, for people.
        throttle: The least time between two pictures, in milliseconds.
        type: The type of the topic. If not given, the name decides: ``.../compressed``
            is compressed, ``.../image_raw`` and similar names are not; for any other
            name the bridge knows the type once the topic has a publisher.

    Raises:
        ConfigError: If the type is not a type of pictures.
    """

    def __init__(
        self,
        robot: Robot,
        bridge: Bridge,
        topic: str,
        name: str = "Camera",
        throttle: int = 200,
        *,
        type: CameraType | None = None,
    ) -> None:
        super().__init__(robot, bridge, topic, name)
        self.type = type_by_name(topic) if type is None else str(split_type(type))
        """The type, without a dialect; None if only the bridge knows it."""
        if self.type not in VIEWS:
            raise ConfigError(f"type is {PACKED} or {RAW}, got {type!r}")
        self._throttle = throttle
        self._drawing: asyncio.Task[None] | None = None
        self._waiting: ImageMsg | None = None

    def subscribe(self) -> None:
        """Subscribe to the pictures."""
        self._bridge.subscribe(
            self.topic,
            draw_or_report(self.robot, self.topic, self.on_picture),
            self.type,
            throttle=self._throttle,
            decode=VIEWS[self.type],
            encoding="binary",
        )

    def end(self) -> None:
        """Unsubscribe."""
        super().end()
        self._waiting = None

    def on_picture(self, image: CompressedImageMsg | ImageMsg | AnyImageMsg) -> None:
        """Show a picture; while a raw one is converted, only the newest waits.

        Raises:
            ProtocolError: If the picture cannot be shown.
        """
        if isinstance(image, AnyImageMsg):
            image = image.raw or image.packed
        if not isinstance(image, ImageMsg):
            self.show(image.data, image.media_type, self._bridge.lag)
        elif image.encoding == JPEG:
            self.show(image.data, "image/jpeg", self._bridge.lag)
        else:
            self._waiting = image
            if self._drawing is None:
                self._drawing = spawn(self._draw())

    async def _draw(self) -> None:
        try:
            while (image := self._waiting) is not None:
                self._waiting = None
                try:
                    data = await asyncio.to_thread(jpeg, image)
                except ProtocolError as error:
                    self.robot.set_problem(self, f"{self.topic}: {error}")
                    continue
                self.robot.clear_problem(self)
                if self._scope is not None:
                    self.show(data, "image/jpeg", self._bridge.lag)
        finally:
            self._drawing = None


def type_by_name(topic: str) -> str | None:
    """Return the type of pictures that a topic's name implies, None if unknown."""
    if topic.endswith("/compressed"):
        return PACKED
    return RAW if PLAIN.search(topic) else None


def jpeg(image: ImageMsg) -> bytes:
    """Return a raw picture as JPEG.

    Raises:
        ProtocolError: If its encoding or its size is not supported.
    """
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(image.pixels()).save(file, "JPEG", quality=75)
    return file.getvalue()


@robot_modules.register
class HttpCamera(CameraFeed):
    """Loads the pictures of a camera over HTTP, once for all pages that watch.

    Pages get the pictures from WebMap and never receive the camera's address. The
    camera's response decides between a stream and a single picture.

    Args:
        robot: The robot that carries the camera.
        address: ``http://`` or ``https://``: a ``multipart/x-mixed-replace`` stream,
            such as ``/stream`` of ``web_video_server``, or a single picture that is
            requested repeatedly, such as ``/snapshot``. For a robot of an agent, the
            camera as the agent names it: the agent loads its pictures.
        name: The camera's name, for people.
        throttle: The least time between two pictures, in milliseconds.

    Raises:
        ConfigError: If the address or the time is not valid.
    """

    def __init__(
        self,
        robot: Robot,
        address: str,
        name: str = "Camera",
        throttle: int = 200,
    ) -> None:
        super().__init__(robot, name)
        if not isinstance(throttle, int) or throttle < 0:
            raise ConfigError(
                f"the throttle of a camera is in milliseconds, 0 or more, got "
                f"{throttle!r}"
            )
        far = isinstance(address, str) and is_agent_url(address)
        self._address = RemoteCamera.parse(address) if far else parse_address(address)
        self._throttle = throttle
        self._pull: Pull | RemoteCameraPull | None = None

    @property
    def address(self) -> str:
        """The camera's address, without possible secrets."""
        return self._address.shown

    def begin(self) -> None:
        """Connect to the camera as soon as the process runs."""
        address, seconds = self._address, self._throttle / 1000
        if isinstance(address, RemoteCamera):
            self._pull = RemoteCameraPull(address, self._show, self._complain)
        else:
            self._pull = Pull(address, seconds, self._show, self._complain)
        lifecycle.add(self._pull)

    def end(self) -> None:
        """Disconnect."""
        if self._pull is not None:
            lifecycle.discard(self._pull)
            self._pull.hang_up()
            self._pull = None

    def _show(self, data: bytes, age: float = 0.0) -> None:
        try:
            media_type = CompressedImageMsg(data).media_type
        except ProtocolError as error:
            self._complain(f"it sends {error}")
            return
        self.robot.clear_problem(self)
        self.show(data, media_type, age)

    def _complain(self, text: str) -> None:
        self.robot.set_problem(self, f"{self.name} at {self.address}: {text}")
