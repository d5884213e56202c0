"""A camera of a robot."""

import asyncio
import io
from typing import TYPE_CHECKING

from webmap.core.camera_feed import CameraFeed
from webmap.core.refusals import refusing
from webmap.core.tasks import spawn
from webmap.errors import ProtocolError
from webmap.ros.bridge import Bridge
from webmap.ros.messages_image import CompressedImageMsg, ImageMsg
from webmap.scope import Scope, no_scope

if TYPE_CHECKING:
    from webmap.core.robot import Robot


class Camera(CameraFeed):
    """Takes the newest picture of a camera, for everybody who watches it.

    The robot is asked for pictures only while somebody does, and once for all. Pages
    get them by URL: show :attr:`url` in an ``<img>``.

    Args:
        robot: The robot that carries the camera.
        bridge: The link to the ROS system that has the topic.
        topic: Of ``sensor_msgs/CompressedImage`` (JPEG, PNG or WebP) if it ends in
            ``/compressed``, else of ``sensor_msgs/Image``.
        name: What people call the camera.
        throttle: The least time between two pictures, in milliseconds.

    """

    def __init__(
        self,
        robot: "Robot",
        bridge: Bridge,
        topic: str,
        name: str = "Camera",
        throttle: int = 200,
    ) -> None:
        super().__init__(robot, name)
        self.topic = topic
        self._bridge = bridge
        self._throttle = throttle
        self._scope: Scope | None = None
        self._drawing: asyncio.Task[None] | None = None
        self._undrawn: ImageMsg | None = None

    def begin(self) -> None:
        """Subscribe to the pictures."""
        self._scope = Scope(f"camera {self.topic}", self._report)
        compressed = self.topic.endswith("/compressed")
        with no_scope(), self._scope.active():
            self._bridge.subscribe(
                self.topic,
                refusing(
                    self.robot,
                    self.topic,
                    self.on_compressed if compressed else self.on_image,
                ),
                f"sensor_msgs/{'CompressedImage' if compressed else 'Image'}",
                throttle=self._throttle,
                decode=CompressedImageMsg if compressed else ImageMsg,
                compression="cbor",
            )

    def end(self) -> None:
        """Unsubscribe."""
        scope, self._scope = self._scope, None
        if scope is not None:
            scope.close()
        self._undrawn = None

    def _report(self, text: str, lasting: bool) -> None:
        if lasting:
            self.robot.set_problem(self, text)
        else:
            self.robot.report_error(text)

    def on_compressed(self, image: CompressedImageMsg) -> None:
        """Show a picture as it is.

        Raises:
            ProtocolError: If no browser can show it.

        """
        self.show(image.data, image.media_type)

    def on_image(self, image: ImageMsg) -> None:
        """Show a raw picture; while one is being made ready, the newest waits.

        Raises:
            ProtocolError: If its encoding or its size cannot be used.

        """
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
                    self._report(f"{self.topic}: {error}", True)
                    continue
                self.robot.clear_problem(self)
                if self._scope is not None:
                    self.show(data, "image/jpeg")
        finally:
            self._drawing = None


def jpeg(image: ImageMsg) -> bytes:
    """Return a raw picture as JPEG.

    Raises:
        ProtocolError: If its encoding or its size cannot be used.

    """
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(image.pixels()).save(file, "JPEG", quality=75)
    return file.getvalue()
