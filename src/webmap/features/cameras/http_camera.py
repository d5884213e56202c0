"""A camera that is on the web: an MJPEG stream, or a picture by its address."""

from typing import TYPE_CHECKING

from webmap.base.errors import ConfigError, ProtocolError
from webmap.base.lifecycle import lifecycle
from webmap.core.registry import robot_modules
from webmap.features.cameras.camera_feed import CameraFeed
from webmap.ros.image_address import parse_address
from webmap.ros.image_pull import Pull
from webmap.ros.messages_image import CompressedImageMsg

if TYPE_CHECKING:
    from webmap.core.robot import Robot


@robot_modules.register
class HttpCamera(CameraFeed):
    """Pulls the pictures of a camera over HTTP, once for everybody who watches.

    Browsers get them from here and never know the address. Whether it is a stream or
    a single picture, its answer tells.

    Args:
        robot: The robot that carries the camera.
        address: ``http://`` or ``https://``; of a ``multipart/x-mixed-replace``
            stream, as ``web_video_server`` has it at ``/stream``, or of a single
            picture that is asked for again, as at ``/snapshot``.
        name: What people call the camera.
        throttle: The least time between two pictures, in milliseconds.

    Raises:
        ConfigError: If that is no such address, or no such time.

    """

    def __init__(
        self,
        robot: "Robot",
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
        self._address = parse_address(address)
        self._throttle = throttle
        self._pull: Pull | None = None

    @property
    def address(self) -> str:
        """Where the camera is, without what may be secret in it."""
        return self._address.shown

    def begin(self) -> None:
        """Connect to the camera, as soon as the process runs."""
        seconds = self._throttle / 1000
        self._pull = Pull(self._address, seconds, self._show, self._complain)
        lifecycle.add(self._pull)

    def end(self) -> None:
        """Hang up."""
        if self._pull is not None:
            lifecycle.discard(self._pull)
            self._pull.hang_up()
            self._pull = None

    def _show(self, data: bytes) -> None:
        try:
            media_type = CompressedImageMsg(data).media_type
        except ProtocolError as error:
            self._complain(f"it sends {error}")
            return
        self.robot.clear_problem(self)
        self.show(data, media_type)

    def _complain(self, words: str) -> None:
        self.robot.set_problem(self, f"{self.name} at {self.address}: {words}")
