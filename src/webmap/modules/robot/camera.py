"""A camera of a robot."""

import asyncio
import io
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from webmap.core.pictures import pictures
from webmap.core.refusals import refusing
from webmap.core.tasks import spawn
from webmap.errors import ProtocolError
from webmap.ros.bridge import Bridge
from webmap.ros.messages_image import CompressedImageMsg, ImageMsg
from webmap.scope import Removable, Removal, Scope, keep, no_scope

if TYPE_CHECKING:
    from webmap.core.robot import Robot

AGE_LIMIT = 1.0
"""Seconds after which a picture is old."""

_KEPT = 3
"""Pictures that may be asked for: pages that lag still ask for the ones before."""


class Camera:
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
        self.robot = robot
        self.topic = topic
        self.name = name
        self.url: str | None = None
        """Where pages find the newest picture; None until there is one."""
        self.stamp: float | None = None
        """When it came, in monotonic seconds."""
        self._bridge = bridge
        self._throttle = throttle
        self._watchers: dict[int, Callable[[], None]] = {}
        self._scope: Scope | None = None
        self._urls: list[str] = []
        self._drawing: asyncio.Task[None] | None = None
        self._undrawn: ImageMsg | None = None

    def destroy(self) -> None:
        """Take the pictures away."""
        self._watchers.clear()
        self._stop()

    @property
    def watched(self) -> bool:
        """Whether anybody watches, so that the robot sends pictures."""
        return bool(self._watchers)

    def watch(self, fn: Callable[[], None]) -> Removable:
        """Call ``fn`` whenever there is another picture.

        Returns:
            What ends it; the end of the current scope does, too.

        """
        key = id(fn)
        self._watchers[key] = fn
        if self._scope is None:
            self._start()

        def undo() -> None:
            self._watchers.pop(key, None)
            if not self._watchers:
                self._stop()

        return keep(Removal(undo))

    def _start(self) -> None:
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

    def _stop(self) -> None:
        scope, self._scope = self._scope, None
        if scope is not None:
            scope.close()
            self.robot.clear_problem(self)
        while self._urls:
            pictures.withdraw(self._urls.pop())
        self.url = self.stamp = self._undrawn = None

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
        self._show(image.data, image.media_type)

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
                    self._show(data, "image/jpeg")
        finally:
            self._drawing = None

    def _show(self, data: bytes, media_type: str) -> None:
        self.url = pictures.publish(data, media_type)
        self.stamp = time.monotonic()
        self._urls.append(self.url)
        while len(self._urls) > _KEPT:
            pictures.withdraw(self._urls.pop(0))
        for fn in tuple(self._watchers.values()):
            fn()


def jpeg(image: ImageMsg) -> bytes:
    """Return a raw picture as JPEG.

    Raises:
        ProtocolError: If its encoding or its size cannot be used.

    """
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(image.pixels()).save(file, "JPEG", quality=75)
    return file.getvalue()
