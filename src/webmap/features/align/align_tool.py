"""Manual alignment of a robot's map with the common map."""

import asyncio
import logging
from collections.abc import Mapping
from typing import Any, ClassVar

from webmap.base.errors import ConfigError
from webmap.base.geometry import Pose
from webmap.base.roles import Role
from webmap.base.tasks import spawn
from webmap.core.alignment_store import name_of, store
from webmap.core.map import Map
from webmap.core.registry import map_modules
from webmap.core.robot import Robot
from webmap.poses.alignment import (
    align_bridge,
    alignment,
    alignments,
    numbers,
    toml_line,
)

log = logging.getLogger("webmap.modules.align_tool")

MAY_ALIGN = ("admin",)

MOVING = ("driving", "stopping")
"""The states of a robot in which its alignment cannot change."""


@map_modules.register
class AlignTool:
    """Aligns the map of the selected robot, or of its bridge, with the common map.

    A drag moves, a handle rotates, fields take exact numbers, and arrow keys move in
    small steps. The page shows a preview, and nothing moves until the operator saves. A
    saved alignment applies to all pages and to goals. It is kept in the state folder
    until a program or a fleet file sets another alignment.
    """

    MAY_SEND: ClassVar[Mapping[str, Role]] = {"begin": "admin", "save": "admin"}

    def __init__(self, map: Map) -> None:
        self.map = map
        for robot in map.robots:
            store.restore(robot)
        self.browser_part = map.add_browser_part(
            self, "features/align/align_tool.js", {}, "features/align/align_tool.css"
        )

    def on_add_robot(self, robot: Robot) -> None:
        """Apply the saved alignment of a robot."""
        store.restore(robot)

    def on_message(self, message: dict[str, Any]) -> None:
        """Begin to align a robot, or save an alignment."""
        begin, save = message.get("begin"), message.get("save")
        if isinstance(begin, str):
            self._begin(begin)
        elif isinstance(save, dict):
            try:
                self._save(save)
            except ConfigError as error:
                self.browser_part.send({"refused": str(error)})
        else:
            log.warning("%r: an unknown message of the page was ignored", self.map)

    def _begin(self, id: str) -> None:
        robot = self.map.find_robot(id)
        why = self._why_refused(robot)
        if robot is None or why is not None:
            self.browser_part.send({"refused": why})
            return
        bridge = robot.pose_source.bridge
        assert bridge is not None  # else it is refused
        together = [r.id for r in self._together(robot)]
        self.browser_part.send(
            {
                "align": {
                    "robot": robot.id,
                    "name": robot.name,
                    "bridge": getattr(bridge, "name", bridge.url),
                    "mark": alignments.mark(bridge),
                    "together": together,
                    "whole": robot.pose_source.own_alignment is None,
                    "own": numbers(robot.pose_source.alignment),
                    "common": numbers(alignments.of(bridge)),
                }
            }
        )

    def _save(self, wanted: dict[str, Any]) -> None:
        robot = self.map.find_robot(wanted.get("robot"))
        pose = alignment(*(wanted.get(key) for key in ("x", "y", "angle")))  # type: ignore[arg-type]
        whole = wanted.get("whole") is True
        why = self._why_refused(robot, whole=whole)
        if robot is None or why is not None:
            raise ConfigError(why or "The robot is no longer on this map.")
        bridge = robot.pose_source.bridge
        assert bridge is not None  # else it is refused
        before: Pose | None
        if whole:
            name, before = name_of(bridge), alignments.stated(bridge)
            store.forget(name_of(bridge, robot.name))
            robot.unset_alignment()
            align_bridge(bridge, *numbers(pose))
        else:
            name = name_of(bridge, robot.name)
            before = robot.pose_source.own_alignment
            robot.set_alignment(*numbers(pose))
        spawn(self._keep(name, before, pose))

    async def _keep(self, name: str, before: Pose | None, pose: Pose) -> None:
        by = self.map.page.viewer.operator.logged
        try:
            path = await asyncio.to_thread(store.save, name, before, pose, by)
        except OSError as error:
            log.error("%s: the alignment cannot be kept: %s", name, error)
            lost = f"Cannot save the alignment: {error}. It is lost when WebMap ends."
        else:
            log.info("%s is aligned by %s: %s", name, by, path)
            lost = ""
        self.browser_part.send({"saved": {"line": toml_line(pose), "lost": lost}})

    def _why_refused(self, robot: Robot | None, *, whole: bool = False) -> str | None:
        """Return why a robot cannot be aligned from this page now, None if it can."""
        if self.map.page.viewer.role not in MAY_ALIGN:
            return "Only admins can align maps."
        if robot is None:
            return "Select a robot first."
        if robot.pose_source.bridge is None:
            return f"Cannot align {robot.name}: its pose is unknown."
        if robot.motion.is_far:
            return (
                f"The agent of {robot.name} aligns it: set the alignment in the fleet "
                "file of the agent."
            )
        concerned = self._together(robot) if whole else [robot]
        for each in concerned:
            if not self.map.page.viewer.may_drive(each.id):
                return f"Only admins of {each.name} can align it."
            if each.report is not None and each.report.state in MOVING:
                return f"{each.name} is being driven. Align it when it is free."
        return None

    def _together(self, robot: Robot) -> list[Robot]:
        """Return the robots that are aligned with a robot's bridge, itself included."""
        bridge = robot.pose_source.bridge
        return [
            each
            for each in self.map.robots
            if each is robot
            or (
                each.pose_source.bridge is bridge
                and each.pose_source.own_alignment is None
            )
        ]
