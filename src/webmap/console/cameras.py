"""What the cameras of a robot see, on its card."""

import math
import time
from typing import TYPE_CHECKING, Any

from webmap import html
from webmap.console.robot_list import AGE_LIMIT

if TYPE_CHECKING:
    from webmap import Element, Robot


class CameraViews:
    """A picture for each camera of one robot; robots send them only while shown."""

    def __init__(self) -> None:
        self.element: Element = html.div(class_="cameras")
        self._views: list[View] = []

    def show(self, robot: "Robot | None") -> None:
        """Show the cameras of a robot in place of those of the one before."""
        for view in self._views:
            view.destroy()
        cameras = [] if robot is None else [m for m in robot.modules if is_camera(m)]
        self._views = [View(camera) for camera in cameras]
        self.element.append(*(view.element for view in self._views))

    def poll(self) -> None:
        """Look at the ages again."""
        for view in self._views:
            view.poll()


class View:
    """What one camera sees."""

    def __init__(self, camera: Any) -> None:
        self.camera = camera
        self._image = html.img(alt=f"{camera.name} of {camera.robot.name}", hidden=True)
        self._age = html.span(class_="age")
        self._age.set_age(math.inf, limit=AGE_LIMIT, age_text=True)
        self.element: Element = html.figure(
            self._image, html.figcaption(html.span(text=camera.name), self._age)
        )
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


def is_camera(module: object) -> bool:
    """Return whether a module of a robot is a camera that can be watched."""
    return hasattr(module, "watch") and hasattr(module, "url")
