"""A person tells the selected robot where it is."""

import logging
from typing import TYPE_CHECKING, Any

from webmap.core.given_pose import robot_and_pose
from webmap.core.registry import map_modules

if TYPE_CHECKING:
    from webmap.core.map import Map

log = logging.getLogger("webmap.modules.initial_pose")


@map_modules.register
class InitialPoseTool:
    """A press on the map is where the selected robot is, a drag which way it looks.

    It begins by its button, by its key or by :meth:`aim`. What is aimed is drawn with
    the ellipse and the wedge of two standard deviations that the robot will be told.
    The page tells it to the gate, which refuses it while the robot moves, follows a
    goal, or is somebody else's.

    Fires ``on_pose_told(robot, x, y, yaw)`` on the map's modules when the gate has
    taken it.

    Args:
        map: The map.
        button: Whether there is a button for it on the map.
        key: The key that begins.

    Raises:
        ValueError: If ``key`` is not one character.

    """

    def __init__(self, map: "Map", *, button: bool = True, key: str = "i") -> None:
        if len(key) != 1:
            raise ValueError(f"InitialPoseTool: key must be one character, got {key!r}")
        self.map = map
        self.half = map.add_browser_half(
            self,
            "features/goals/initial_pose_tool.js",
            {"button": button, "key": key},
            "features/goals/initial_pose_tool.css",
        )

    def aim(self) -> None:
        """Let the viewer's next press on the map say where the robot is."""
        self.half.send({"active": True})

    def on_message(self, message: dict[str, Any]) -> None:
        """Take what the page says that it told, or tell it how sure that will be."""
        if "doubt" in message:
            self._tell_doubt(message["doubt"])
        elif isinstance(message.get("told"), dict):
            told = robot_and_pose(self.map, message["told"])
            if told is not None:
                self.map.notify_modules("on_pose_told", *told)
        else:
            log.warning("%r: an unknown message of the page was ignored", self.map)

    def _tell_doubt(self, id: Any) -> None:
        robot = self.map.find_robot(id)
        spec = robot.motion.spec() if robot is not None else None
        if robot is None or spec is None or spec.pose_topic is None:
            self.half.send({"doubt": None})
            return
        x, y, yaw = spec.pose_covariance
        doubt = {"robot": robot.id, "x": x, "y": y, "yaw": yaw, "turn": spec.own_map[2]}
        self.half.send({"doubt": doubt})
