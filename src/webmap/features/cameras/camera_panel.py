"""Pictures of cameras: those of a robot on its card, one or several of them large."""

import itertools
import math
import secrets
import time
import weakref
from collections.abc import Mapping
from functools import partial
from typing import Any, ClassVar

from webmap import Element, Map, Robot, html
from webmap.base.roles import Role
from webmap.features.cameras.camera import AGE_LIMIT

# A page that was open before a restart must not get pictures of another camera.
_numbers = itertools.count(secrets.randbelow(1 << 40))
_number_of: weakref.WeakKeyDictionary[Any, int] = weakref.WeakKeyDictionary()


class CameraViews:
    """A picture for each camera of one robot; the robot sends only visible cameras."""

    def __init__(self) -> None:
        self.element: Element = html.div(class_="cameras")
        self._robot: Robot | None = None
        self._views: list[CameraPicture] = []

    def show(self, robot: Robot | None) -> None:
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
        # camera_panel.js shows the video there.
        self._video = html.span(class_="camera-video")
        button = html.button(
            self._video if hasattr(camera, "video") else self._image,
            html.span(
                html.span(text=camera.name, class_="camera-title"),
                self._age,
                class_="camera-line",
            ),
            type="button",
            class_="camera-small",
            title="Show the camera large or small",
            # camera_panel.js shows it without a round trip.
            data_camera_id=str(camera_number(camera)),
        )
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
        url, video = self.camera.url, video_of(self.camera)
        if video is not None:
            self._video.set("data-video", video)
        elif url is not None:
            self._image.set(src=url, hidden=False)
            self._age.set_age(0.0)


MOST_WATCHED = 4
"""Cameras that a page shows large at the same time."""


class CameraPanel:
    """Sends a page the pictures of the cameras that it shows large; a module of maps.

    The page chooses the camera of the selected robot, or a wall of cameras of several
    robots, and the position of the panel, and stores all of it.
    """

    MAY_SEND: ClassVar[Mapping[str, Role]] = {
        "watch": "viewer",
        "select": "viewer",
    }

    def __init__(self, map: Map) -> None:
        self.map = map
        self._wall = False
        self._cameras: dict[int, Any] = {}
        self._sent: dict[str, Any] = {}
        self._watching: dict[Any, Any] = {}
        self.browser_part = map.add_browser_part(
            self,
            "features/cameras/camera_panel.js",
            {},
            "features/cameras/cameras.css",
        )

    def destroy(self) -> None:
        """Stop the pictures."""
        self._watch([])

    def on_ready(self) -> None:
        """Send the cameras to a page that has connected or reconnected."""
        self._watch([])
        self._wall = False
        self._sent = {}
        self.poll()

    def on_select(self) -> None:
        """Send the page the cameras of the robot selected now."""
        self.poll()

    def poll(self) -> None:
        """Send the page the cameras that were added or removed."""
        selected = self.map.selected
        robots = [r for r in self.map.robots if cameras_of(r)] if self._wall else []
        messages = {"cameras": {"op": "cameras", **_listed(selected)}}
        if self._wall:
            listed = [_listed(robot) for robot in robots]
            messages["robots"] = {"op": "robots", "robots": listed}
        if messages == self._sent:
            return
        before, self._sent = self._sent, messages
        self._cameras = {
            camera_number(camera): camera
            for robot in (selected, *robots)
            for camera in cameras_of(robot)
        }
        known = self._cameras.values()
        self._watch([camera for camera in self._watching if camera in known])
        for op, message in messages.items():
            if message != before.get(op):
                self.browser_part.send(message)

    def on_message(self, message: dict[str, Any]) -> None:
        """Send the pictures that the page shows, or select the robot of a camera."""
        if message.get("op") == "watch":
            self._wall = message.get("wall") is True
            self.poll()
            asked = message.get("cameras")
            numbers = asked[:MOST_WATCHED] if isinstance(asked, list) else []
            # Only numbers that the page has received are valid.
            known = self._cameras
            self._watch([known[n] for n in numbers if type(n) is int and n in known])
        elif message.get("op") == "select":
            robot = self.map.find_robot(message.get("robot"))
            if robot is not None:
                self.map.set_selected(robot)

    def _watch(self, cameras: list[Any]) -> None:
        for camera in [other for other in self._watching if other not in cameras]:
            self._watching.pop(camera).remove()
        for camera in cameras:
            if camera not in self._watching:
                self._watching[camera] = camera.watch(partial(self._show, camera))
                self._show(camera)

    def _show(self, camera: Any) -> None:
        video, about = video_of(camera), {"camera": camera_number(camera)}
        if video is not None:
            self.browser_part.send({"op": "video", **about, "url": video})
        elif camera.url is not None:
            picture = {"url": camera.url, "stamp": camera.stamp}
            self.browser_part.send({"op": "picture", **about, **picture})


def _listed(robot: Robot | None) -> dict[str, Any]:
    return {
        "robot": "" if robot is None else robot.id,
        "name": "" if robot is None else robot.name,
        "cameras": [
            {"id": camera_number(camera), "name": camera.name}
            for camera in cameras_of(robot)
        ],
    }


def cameras_of(robot: Robot | None) -> list[Any]:
    """Return the robot's modules that are cameras; none without a robot."""
    modules = [] if robot is None else robot.modules
    return [m for m in modules if hasattr(m, "watch") and hasattr(m, "url")]


def video_of(camera: Any) -> str | None:
    """Return the URL of a camera's video; None if it has pictures."""
    found: str | None = getattr(camera, "video", None)
    return found


def camera_number(camera: Any) -> int:
    """Return a camera's number on pages; unique, also after a restart."""
    if camera not in _number_of:
        _number_of[camera] = next(_numbers)
    return _number_of[camera]
