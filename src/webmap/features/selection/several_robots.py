"""Selects several robots at once, and shows what can be done with them."""

import logging
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from webmap.base.roles import Role
from webmap.core.map import Map

log = logging.getLogger("webmap.modules.several_robots")

MOST = 50
"""The greatest number of robots that are selected at once: the page sends a STOP for
each of them, and a page that sends more than 120 messages at once to the gate loses
that connection."""


class SeveralRobots:
    """Selects robots by a box, and has buttons for all selected robots.

    STOP and the cancelling of goals go from the page to the gate, one message for each
    robot, as for one robot. A module of maps.

    Args:
        map: The map.
        aim_goal: Called to make the next press on the map the goal.
        rows: A CSS selector of the elements whose ``data-robot`` the button selects.
        button: A CSS selector of the page's button that selects them; none if empty.
    """

    MAY_SEND: ClassVar[Mapping[str, Role]] = {
        "mark": "viewer",
        "clear": "viewer",
        "aim": "operator",
    }

    def __init__(
        self,
        map: Map,
        aim_goal: Callable[[], object],
        *,
        rows: str = "",
        button: str = "",
    ) -> None:
        self.map = map
        self._aim_goal = aim_goal
        self.browser_part = map.add_browser_part(
            self,
            "features/selection/several_robots.js",
            {"most": MOST, "rows": rows, "button": button},
            "features/selection/several_robots.css",
        )

    def on_message(self, message: dict[str, Any]) -> None:
        """Select robots in addition, unmark them, or aim a goal."""
        ids = message.get("mark")
        if isinstance(ids, list):
            self._mark(ids)
        elif message.get("clear") is True:
            for robot in tuple(self.map.marked):
                self.map.set_marked(robot, False)
        elif message.get("aim") is True:
            self._aim_goal()
        else:
            log.warning("%r: an unknown message of the page was ignored", self.map)

    def _mark(self, ids: list[object]) -> None:
        """Select robots in addition to the selected ones, as many as the limit allows.

        Args:
            ids: The ids of robots; they come from a page, so they may be anything.
        """
        wanted = {id for id in ids if isinstance(id, str)}
        chosen = (self.map.selected, *self.map.marked)
        robots = [
            robot
            for robot in self.map.robots
            if robot.id in wanted and robot not in chosen
        ]
        place = MOST - sum(robot is not None for robot in chosen)
        for robot in robots[: max(0, place)]:
            if self.map.selected is None:
                self.map.set_selected(robot)
            else:
                self.map.set_marked(robot, True)
        left = len(robots) - max(0, place)
        problem = f"At most {MOST} robots: {left} not selected." if left > 0 else ""
        self.browser_part.send({"problem": problem})
