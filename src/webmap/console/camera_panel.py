"""One camera of the selected robot, large: the half of its panel that has pictures."""

import itertools
import weakref
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from webmap import Map, Robot

PARTS = (
    "camera_picture.js",
    "camera_place.js",
    "camera_view.js",
    "dom.js",
    "sheet.js",
)
"""What camera_panel.js imports; a browser can load what was published."""

_numbers = itertools.count(1)
_number_of: "weakref.WeakKeyDictionary[Any, int]" = weakref.WeakKeyDictionary()


class CameraPanel:
    """Sends a page the pictures of the camera that it has chosen; a module of maps.

    Which camera that is, and where the panel is, the page decides and remembers.

    Args:
        map: The map.

    """

    def __init__(self, map: "Map") -> None:
        self.map = map
        self._robot: Robot | None = None
        self._cameras: dict[int, Any] = {}
        self._told: dict[str, Any] | None = None
        self._watched: Any = None
        self._watching: Any = None
        folder = Path(__file__).parent
        for name in PARTS:
            map.page.asset(folder / name)
        self.half = map.add_browser_half(
            self, folder / "camera_panel.js", {}, folder / "cameras.css"
        )

    def destroy(self) -> None:
        """Ask for no more pictures."""
        self._watch(None)

    def on_ready(self) -> None:
        """Tell a page that has come, or come back, what there is."""
        self._watch(None)
        self._told = None
        self.poll()

    def on_select(self) -> None:
        """Tell the page of the cameras of another robot."""
        self.poll()

    def poll(self) -> None:
        """Tell the page of cameras that came or went."""
        robot = self.map.selected
        cameras = cameras_of(robot)
        told = {
            "op": "cameras",
            "robot": "" if robot is None else robot.id,
            "name": "" if robot is None else robot.name,
            "cameras": [
                {"id": camera_number(camera), "name": camera.name} for camera in cameras
            ],
        }
        if told == self._told:
            return
        self._told = told
        self._cameras = {camera_number(camera): camera for camera in cameras}
        self._watch(None)
        self.half.send(told)

    def on_message(self, message: dict[str, Any]) -> None:
        """Send the pictures of the camera that the page looks at, or of none."""
        number = message.get("camera")
        if message.get("op") == "watch":
            # A page names what it was told of, and nothing else.
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
            self.half.send(
                {
                    "op": "picture",
                    "camera": camera_number(camera),
                    "url": camera.url,
                    "stamp": camera.stamp,
                }
            )


def cameras_of(robot: "Robot | None") -> list[Any]:
    """Return the cameras among the modules of a robot."""
    return [] if robot is None else [m for m in robot.modules if is_camera(m)]


def is_camera(module: object) -> bool:
    """Return whether a module of a robot is a camera that can be watched."""
    return hasattr(module, "watch") and hasattr(module, "url")


def camera_number(camera: Any) -> int:
    """Return what pages call a camera; unique in the process."""
    if camera not in _number_of:
        _number_of[camera] = next(_numbers)
    return _number_of[camera]
