"""Pictures of a robot's cameras: all of them on its card, one of them large."""

import itertools
import math
import time
import weakref
from typing import TYPE_CHECKING, Any

from webmap import html
from webmap.features.cameras.camera import AGE_LIMIT

if TYPE_CHECKING:
    from webmap import Element, Map, Robot

_numbers = itertools.count(1)
_number_of: "weakref.WeakKeyDictionary[Any, int]" = weakref.WeakKeyDictionary()


class CameraViews:
    """A picture for each camera of one robot; the robot sends only visible cameras."""

    def __init__(self) -> None:
        self.element: Element = html.div(class_="cameras")
        self._robot: Robot | None = None
        self._views: list[CameraPicture] = []

    def show(self, robot: "Robot | None") -> None:
        """Show the cameras of a robot in place of those of the last one."""
        self._robot = robot
        for view in self._views:
            view.destroy()
        self._views = [CameraPicture(camera) for camera in cameras_of(robot)]
        self.element.append(*(view.element for view in self._views))

    def poll(self) -> None:
        """Update the ages and the list of cameras."""
        if cameras_of(self._robot) != [view.camera for view in self._views]:
            self.show(self._robot)
        for view in self._views:
            view.poll()


class CameraPicture:
    """The picture of one camera; a press shows it large."""

    def __init__(self, camera: Any) -> None:
        self.camera = camera
        self._image = html.img(alt=f"{camera.name} of {camera.robot.name}", hidden=True)
        self._age = html.span(class_="picture-age")
        self._age.set_age(math.inf, limit=AGE_LIMIT, age_text=True)
        button = html.button(
            self._image,
            html.span(
                html.span(text=camera.name, class_="camera-title"),
                self._age,
                class_="camera-line",
            ),
            type="button",
            class_="camera-small",
            title="Show the camera large or small",
        )
        # camera_panel.js shows it without a round trip.
        button.set("data-camera-id", str(camera_number(camera)))
        self.element: Element = html.figure(button)
        self._watching = camera.watch(self._show)
        self._show()

    def destroy(self) -> None:
        """Stop watching."""
        self._watching.remove()
        self.element.remove()

    def poll(self) -> None:
        """Show the picture's age."""
        stamp = self.camera.stamp
        self._age.set_age(math.inf if stamp is None else time.monotonic() - stamp)

    def _show(self) -> None:
        url = self.camera.url
        if url is not None:
            self._image.set(src=url, hidden=False)
            self._age.set_age(0.0)


class CameraPanel:
    """Sends a page the pictures of the camera that it has chosen; a module of maps.

    The page chooses the camera and the position of the panel, and stores both.
    """

    def __init__(self, map: "Map") -> None:
        self.map = map
        self._robot: Robot | None = None
        self._cameras: dict[int, Any] = {}
        self._sent: dict[str, Any] | None = None
        self._watched: Any = None
        self._watching: Any = None
        self.browser_part = map.add_browser_part(
            self,
            "features/cameras/camera_panel.js",
            {},
            "features/cameras/cameras.css",
        )

    def destroy(self) -> None:
        """Stop the pictures."""
        self._watch(None)

    def on_ready(self) -> None:
        """Send the cameras to a page that has connected or reconnected."""
        self._watch(None)
        self._sent = None
        self.poll()

    def on_select(self) -> None:
        """Send the page the cameras of the robot selected now."""
        self.poll()

    def poll(self) -> None:
        """Send the page the cameras that were added or removed."""
        robot = self.map.selected
        cameras = cameras_of(robot)
        message = {
            "op": "cameras",
            "robot": "" if robot is None else robot.id,
            "name": "" if robot is None else robot.name,
            "cameras": [
                {"id": camera_number(camera), "name": camera.name} for camera in cameras
            ],
        }
        if message == self._sent:
            return
        self._sent = message
        self._cameras = {camera_number(camera): camera for camera in cameras}
        self._watch(None)
        self.browser_part.send(message)

    def on_message(self, message: dict[str, Any]) -> None:
        """Send the pictures of the camera that the page has chosen, or none."""
        number = message.get("camera")
        if message.get("op") == "watch":
            # Only numbers that the page has received are valid.
            self._watch(self._cameras.get(number) if type(number) is int else None)

    def _watch(self, camera: Any) -> None:
        if self._watching is not None:
            self._watching.remove()
            self._watching = None
        self._watched = camera
        if camera is not None:
            self._watching = camera.watch(self._show)
            self._show()

    def _show(self) -> None:
        camera = self._watched
        if camera is not None and camera.url is not None:
            self.browser_part.send(
                {
                    "op": "picture",
                    "camera": camera_number(camera),
                    "url": camera.url,
                    "stamp": camera.stamp,
                }
            )


def cameras_of(robot: "Robot | None") -> list[Any]:
    """Return the robot's modules that are cameras; none without a robot."""
    return [] if robot is None else [m for m in robot.modules if is_camera(m)]


def is_camera(module: object) -> bool:
    """Return whether a module has the two names that a panel needs of a camera."""
    return hasattr(module, "watch") and hasattr(module, "url")


def camera_number(camera: Any) -> int:
    """Return a camera's number on pages; unique in the process."""
    if camera not in _number_of:
        _number_of[camera] = next(_numbers)
    return _number_of[camera]
