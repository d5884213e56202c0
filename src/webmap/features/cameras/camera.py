"""A camera of a robot."""

import asyncio
import io
import re
from typing import TYPE_CHECKING, Literal, TypeAlias

import msgspec

from webmap.base.errors import ConfigError, ProtocolError
from webmap.base.scope import Scope, no_scope
from webmap.base.tasks import spawn
from webmap.core.problems import draw_or_report
from webmap.core.registry import robot_modules
from webmap.features.cameras.camera_feed import CameraFeed
from webmap.ros.bridge import Bridge
from webmap.ros.messages_image import AnyImageMsg, CompressedImageMsg, ImageMsg
from webmap.ros.names import split_type

if TYPE_CHECKING:
    from webmap.core.robot import Robot


CameraType: TypeAlias = Literal[
    "sensor_msgs/CompressedImage",
    "sensor_msgs/Image",
    "sensor_msgs/msg/CompressedImage",
    "sensor_msgs/msg/Image",
]
"""The types of pictures, in both dialects."""

PACKED, RAW = "sensor_msgs/CompressedImage", "sensor_msgs/Image"

DRAWN = "jpeg"
"""The encoding of a large raw picture after the worker process has drawn it."""


class ShownImageMsg(ImageMsg):
    """A raw picture that is converted to JPEG if it is large."""

    def digest(self) -> ImageMsg:
        """Return the picture as JPEG; called in the worker process.

        Raises:
            ProtocolError: If its encoding or its size is not supported.
        """
        return msgspec.structs.replace(self, encoding=DRAWN, data=jpeg(self))


class ShownAnyImageMsg(AnyImageMsg):
    """A picture of either type; a large raw picture is converted to JPEG."""

    def digest(self) -> AnyImageMsg:
        """Return the picture as JPEG if it is raw; called in the worker process.

        Raises:
            ProtocolError: If its encoding or its size is not supported.
        """
        if self.raw is None:
            return self
        return msgspec.structs.replace(self, encoding=DRAWN, data=jpeg(self.raw))


VIEWS: dict[str | None, type[msgspec.Struct]] = {
    PACKED: CompressedImageMsg,
    RAW: ShownImageMsg,
    None: ShownAnyImageMsg,
}

PLAIN = re.compile(r"/image(?![^/]*(?:compress|jpe?g|png|webp))[^/]*\Z")
"""Names of raw pictures, by the convention of image_transport."""


@robot_modules.register
class Camera(CameraFeed):
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
        robot: "Robot",
        bridge: Bridge,
        topic: str,
        name: str = "Camera",
        throttle: int = 200,
        *,
        type: CameraType | None = None,
    ) -> None:
        super().__init__(robot, name)
        self.type = type_by_name(topic) if type is None else str(split_type(type))
        """The type, without a dialect; None if only the bridge knows it."""
        if self.type not in VIEWS:
            raise ConfigError(f"type is {PACKED} or {RAW}, got {type!r}")
        self.topic = topic
        self._bridge = bridge
        self._throttle = throttle
        self._scope: Scope | None = None
        self._drawing: asyncio.Task[None] | None = None
        self._undrawn: ImageMsg | None = None

    def begin(self) -> None:
        """Subscribe to the pictures."""
        self._scope = Scope(
            f"camera {self.topic}", self._report, self.robot.clear_problem
        )
        with no_scope(), self._scope.active():
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
        scope, self._scope = self._scope, None
        if scope is not None:
            scope.close()
        self._undrawn = None

    def _report(self, text: str, about: object) -> None:
        if about is None:
            self.robot.report_error(text)
        else:
            self.robot.set_problem(about, text)

    def on_picture(self, image: CompressedImageMsg | ImageMsg | AnyImageMsg) -> None:
        """Show a picture of either type.

        Raises:
            ProtocolError: If the picture cannot be shown.
        """
        if isinstance(image, AnyImageMsg):
            image = image.raw or image.packed
        if isinstance(image, ImageMsg):
            self.on_image(image)
        else:
            self.on_compressed(image)

    def on_compressed(self, image: CompressedImageMsg) -> None:
        """Show a compressed picture unchanged.

        Raises:
            ProtocolError: If browsers cannot show it.
        """
        self.show(image.data, image.media_type, self._bridge.lag)

    def on_image(self, image: ImageMsg) -> None:
        """Show a raw picture; while one is being converted, only the newest waits.

        Raises:
            ProtocolError: If its encoding or its size is not supported.
        """
        if image.encoding == DRAWN:
            self.show(image.data, "image/jpeg", self._bridge.lag)
            return
        self._undrawn = image
        if self._drawing is None:
            self._drawing = spawn(self._draw())

    async def _draw(self) -> None:
        try:
            while (image := self._undrawn) is not None:
                self._undrawn = None
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
