"""Tools that send a goal or an initial pose to the selected robots."""

import logging
from collections.abc import Mapping
from typing import Any, ClassVar

from webmap.base.roles import Role
from webmap.core.map import Map, place_of, robot_and_pose
from webmap.core.registry import map_modules
from webmap.core.robot import Robot

log = logging.getLogger("webmap.modules.goal_tool")
_pose_log = logging.getLogger("webmap.modules.initial_pose")

SPACING = (0.3, 20.0)
"""Smallest and greatest distance between robots that are sent together, in metres."""


FREE, OCCUPIED = 25, 65
"""A cell below the first value is free, and from the second on a wall, as in map_saver;
between them and below zero it is unknown."""


def ground_at(map: Map, x: float, y: float) -> str | None:
    """Return what the maps have at a place: ``"free"``, ``"unknown"`` or ``"wall"``.

    A wall of one map counts, whatever the others have there.

    Returns:
        None if no map is shown.
    """
    cells = []
    for module in map.modules:
        cell_at = getattr(getattr(module, "layer", module), "cell_at", None)
        cell = None if cell_at is None else cell_at(x, y)
        if cell is not None:
            cells.append(cell)
    if not cells:
        return None
    if max(cells) >= OCCUPIED:
        return "wall"
    known = [cell for cell in cells if cell >= 0]
    return "free" if known and max(known) < FREE else "unknown"


@map_modules.register
class GoalTool:
    """A press on the map sets the selected robot's goal, a drag sets its heading.

    With several selected robots each press is for the next one. With Alt it is for all:
    they get goals in a line across the heading, or in a grid if they are more than
    four, and each robot gets the place that keeps distances short.

    While a goal is aimed, the page shows what the maps have there (free, unknown or
    wall); a goal can be sent anywhere. A module of maps is a map if it, or its layer,
    has a method ``cell_at(x, y)``, as of :class:`OccupancyGrid`.

    The tool begins with its button, its key or :meth:`aim`; nothing is sent before the
    operator presses on the map, and then the page sends the goal to the gate itself.

    Fires ``on_goal_sent(robot, x, y, yaw)`` on the map's modules when the gate has
    accepted a goal, and ``on_goal_canceled(robot)``.

    Args:
        map: The map.
        button: Whether the map has a button for the tool.
        key: The key that begins the tool.
        spacing: The distance between robots that are sent together, in metres.

    Raises:
        ValueError: If ``key`` is not one character, or ``spacing`` is not from 0.3 to
            20 m.
    """

    MAY_SEND: ClassVar[Mapping[str, Role]] = {
        "ground": "viewer",
        "mark": "viewer",
        "goal": "operator",
        "cancel": "operator",
    }

    def __init__(
        self,
        map: Map,
        *,
        button: bool = True,
        key: str = "g",
        spacing: float = 1.0,
    ) -> None:
        if len(key) != 1:
            raise ValueError(f"GoalTool: key must be one character, got {key!r}")
        least, most = SPACING
        if not least <= spacing <= most:
            raise ValueError(
                f"GoalTool: spacing is {least:g} to {most:g} m, got {spacing!r}"
            )
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/goals/goal_tool.js",
            {"button": button, "key": key, "spacing": spacing},
            "features/goals/goal_tool.css",
        )

    def aim(self) -> None:
        """Make the operator's next press on the map the goal."""
        self.browser_part.send({"active": True})

    def forget(self, robot: Robot) -> None:
        """Remove the arrow of a goal that was reached or is not driven to."""
        self.browser_part.send({"reached": robot.id})

    def on_message(self, message: dict[str, Any]) -> None:
        """Handle sent and canceled goals, and judge the cell under an aimed goal."""
        goal, canceled = message.get("goal"), message.get("cancel")
        ground = place_of(message.get("ground"))
        if ground is not None:
            x, y = ground
            word = ground_at(self.map, x, y)
            self.browser_part.send({"ground": {"x": x, "y": y, "word": word}})
        elif isinstance(goal, dict):
            sent = robot_and_pose(self.map, goal)
            if sent is not None:
                self.map.notify_modules("on_goal_sent", *sent)
        elif isinstance(message.get("mark"), str):
            robot = self.map.find_robot(message["mark"])
            if robot is not None:
                self.map.toggle_marked(robot)
        elif isinstance(canceled, str):
            robot = self.map.find_robot(canceled)
            if robot is not None:
                self.map.notify_modules("on_goal_canceled", robot)
        else:
            log.warning("%r: an unknown message of the page was ignored", self.map)


@map_modules.register
class InitialPoseTool:
    """A press on the map sets the selected robot's position, a drag sets its heading.

    The tool begins with its button, its key or :meth:`aim`. The aimed pose is drawn
    with the ellipse and the wedge of two standard deviations, which the robot receives
    with the pose. The page sends the pose to the gate, which refuses it while the robot
    moves, follows a goal, or another operator has control.

    Fires ``on_pose_told(robot, x, y, yaw)`` on the map's modules when the gate has
    accepted the pose.

    Args:
        map: The map.
        button: Whether the map has a button for the tool.
        key: The key that begins the tool.

    Raises:
        ValueError: If ``key`` is not one character.
    """

    MAY_SEND: ClassVar[Mapping[str, Role]] = {
        "covariance": "operator",
        "pose": "operator",
    }

    def __init__(self, map: Map, *, button: bool = True, key: str = "i") -> None:
        if len(key) != 1:
            raise ValueError(f"InitialPoseTool: key must be one character, got {key!r}")
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/goals/initial_pose_tool.js",
            {"button": button, "key": key},
            "features/goals/goal_tool.css",
        )

    def aim(self) -> None:
        """Make the operator's next press on the map the robot's pose."""
        self.browser_part.send({"active": True})

    def on_message(self, message: dict[str, Any]) -> None:
        """Handle the page's message of a sent pose, or send the page variances."""
        if "covariance" in message:
            self._send_covariance(message["covariance"])
        elif isinstance(message.get("pose"), dict):
            pose = robot_and_pose(self.map, message["pose"])
            if pose is not None:
                self.map.notify_modules("on_pose_told", *pose)
        else:
            _pose_log.warning(
                "%r: an unknown message of the page was ignored", self.map
            )

    def _send_covariance(self, id: Any) -> None:
        robot = self.map.find_robot(id)
        spec = robot.motion.spec() if robot is not None else None
        if robot is None or spec is None or spec.initial_pose is None:
            self.browser_part.send({"covariance": None})
            return
        x, y, yaw = spec.initial_pose.covariance
        covariance = {
            "robot": robot.id,
            "x": x,
            "y": y,
            "yaw": yaw,
            "turn": spec.own_map[2],
        }
        self.browser_part.send({"covariance": covariance})
