"""What the cameras of a robot see, on its card."""

import math
import time
from typing import TYPE_CHECKING, Any

from webmap import html
from webmap.console.camera_panel import camera_number, cameras_of
from webmap.console.robot_list import AGE_LIMIT

if TYPE_CHECKING:
    from webmap import Element, Robot


class CameraViews:
    """A picture for each camera of one robot; robots send them only while shown."""

    def __init__(self) -> None:
        self.element: Element = html.div(class_="cameras")
        self._robot: Robot | None = None
        self._views: list[View] = []

    def show(self, robot: "Robot | None") -> None:
        """Show the cameras of a robot in place of those of the one before."""
        self._robot = robot
        for view in self._views:
            view.destroy()
        self._views = [View(camera) for camera in cameras_of(robot)]
        self.element.append(*(view.element for view in self._views))

    def poll(self) -> None:
        """Look at the ages again, and whether there are other cameras now."""
        if cameras_of(self._robot) != [view.camera for view in self._views]:
            self.show(self._robot)
        for view in self._views:
            view.poll()


class View:
    """What one camera sees; pressed, it is shown large."""

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
            title="Show it large, or small again",
        )
        # camera_panel.js shows it, without a way to here and back.
        button.set("data-camera-id", str(camera_number(camera)))
        self.element: Element = html.figure(button)
        self._watching = camera.watch(self._show)
        self._show()

    def destroy(self) -> None:
        """Watch no more."""
        self._watching.remove()
        self.element.remove()

    def poll(self) -> None:
        """Say how old the picture is."""
        stamp = self.camera.stamp
        self._age.set_age(math.inf if stamp is None else time.monotonic() - stamp)

    def _show(self) -> None:
        url = self.camera.url
        if url is not None:
            self._image.set(src=url, hidden=False)
            self._age.set_age(0.0)
