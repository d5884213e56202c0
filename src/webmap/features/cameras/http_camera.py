"""A camera over HTTP: an MJPEG stream, or single pictures."""

from typing import TYPE_CHECKING

from webmap.agents.remote_camera import RemoteCamera, RemoteCameraPull
from webmap.base.errors import ConfigError, ProtocolError
from webmap.base.lifecycle import lifecycle
from webmap.core.registry import robot_modules
from webmap.features.cameras.camera_feed import CameraFeed
from webmap.ros.image_address import parse_address
from webmap.ros.image_pull import Pull
from webmap.ros.messages_image import CompressedImageMsg
from webmap.ros.names import is_agent_url

if TYPE_CHECKING:
    from webmap.core.robot import Robot


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
