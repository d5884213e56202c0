"""The selected robots are sent to a place on the map."""

import logging
from typing import TYPE_CHECKING, Any

from webmap.core.given_pose import robot_and_pose
from webmap.core.registry import map_modules

if TYPE_CHECKING:
    from webmap.core.map import Map
    from webmap.core.robot import Robot

log = logging.getLogger("webmap.modules.goal_tool")


SPACING = (0.3, 20.0)
"""Metres between robots that are sent together, the least and the most."""


@map_modules.register
class GoalTool:
    """A press on the map is where the selected robot goes, a drag how it stands there.

    Robots that are marked besides go there too, in a line across the heading, or in a
    grid if they are more than four; each to the place that keeps ways short.

    It begins by its button, by its key or by :meth:`aim`; nothing is sent before the
    viewer presses on the map, and then the page sends it to the gate by itself.

    Fires ``on_goal_sent(robot, x, y, yaw)`` on the map's modules when the gate has
    accepted a goal, and ``on_goal_canceled(robot)``.

    Args:
        map: The map.
        button: Whether there is a button for it on the map.
        key: The key that begins.
        spacing: How far from each other several robots are sent, in metres.

    Raises:
        ValueError: If ``key`` is not one character, or ``spacing`` is not from 0.3 to
            20 m.

    """

    def __init__(
        self,
        map: "Map",
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
        self.half = map.add_browser_half(
            self,
            "features/goals/goal_tool.js",
            {"button": button, "key": key, "spacing": spacing},
            "features/goals/goal_tool.css",
        )

    def aim(self) -> None:
        """Let the viewer's next press on the map be the goal."""
        self.half.send({"active": True})

    def forget(self, robot: "Robot") -> None:
        """Take the arrow of a robot's goal away: it got there, or does not go."""
        self.half.send({"reached": robot.id})

    def on_message(self, message: dict[str, Any]) -> None:
        """Take what the page says that it sent."""
        goal, canceled = message.get("goal"), message.get("cancel")
        if isinstance(goal, dict):
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
