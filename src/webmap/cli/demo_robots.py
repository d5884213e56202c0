"""The simulator's robots as the demo shows them."""

import asyncio
import contextlib
from typing import TYPE_CHECKING, Any

from webmap.base.errors import BridgeClosed
from webmap.base.tasks import spawn
from webmap.gate.protocol import RobotReport

if TYPE_CHECKING:
    from webmap import Bridge, Robot

FREE = 2
"""Number of robots without errands, which are the first ones."""

RADIUS = 0.25
"""Radius of a simulated base, in metres."""

REPEAT = 1.0
"""Seconds between two messages that pause the errands of a robot."""


def demo_robot(
    bridge: "Bridge", index: int, dialect: str = "ros1", *, quiet: bool = False
) -> "Robot":
    """Return one of the simulator's robots, with modules that show its behavior.

    Drawing all its topics would hide the map; ``webmap view`` draws all of them.

    Args:
        bridge: The simulator's bridge.
        index: Number of the robot, from 0.
        dialect: The ROS that the simulator imitates, ``"ros1"`` or ``"ros2"``.
        quiet: Whether the robot has no scan assist, no costmap and no errands.

    """
    import webmap
    from webmap.console import make_robot

    topics = f"/robot_{index}"
    link = {"bridge": bridge.url}
    lookahead = {"name": "lookahead", "frame": "robot", "age_limit": 2.0}
    point = f"{topics}/lookahead_point"
    modules: list[dict[str, Any]] = [
        {"name": "Path", "args": [link, f"{topics}/plan"]},
        {"name": "Trail", "options": {"length": 10.0}},
        {"name": "PointStamped", "args": [link, point], "options": lookahead},
        {"name": "Diagnostics", "args": [link], "options": {"namespace": topics}},
    ]
    config = {
        "name": f"Robot {index}",
        "bridge": bridge.url,
        "odometry": f"{topics}/odom",
        "twist": {"topic": f"{topics}/cmd_vel", "stops_within": 0.25},
        "scan": f"{topics}/base_scan",
        "battery": f"{topics}/battery_state",
        "cameras": f"{topics}/camera/image_raw/compressed",
        "move": _move(topics, dialect),
        "initial_pose": f"{topics}/initialpose",
        "modules": modules,
    }
    if not quiet:
        config["scan_assist"] = {"topic": f"{topics}/base_scan", "footprint": RADIUS}
    if not quiet and index == FREE:
        above = "" if dialect == "ros2" else "/move_base"
        costmap = f"{topics}{above}/local_costmap/costmap"
        options = {"palette": "costmap", "throttle": 500}
        shown = {"args": ["OccupancyGrid", link, costmap], "options": options}
        modules.append({"name": "OnMaps", **shown})
    if not quiet and index >= FREE:
        markers = {"args": ["Markers", link, f"{topics}/markers"]}
        modules.append({"name": "OnMaps", **markers})
    robot = make_robot(webmap.RobotConfig.from_dict(config), [bridge])
    if not quiet and index >= FREE:
        robot.add_module(PauseErrands, bridge, f"{topics}/errands/pause")
    return robot


def _move(topics: str, dialect: str) -> dict[str, str]:
    """Return where goals of a robot go."""
    if dialect == "ros2":
        return {
            "topic": f"{topics}/goal_pose",
            "action": f"{topics}/navigate_to_pose",
            "action_type": "nav2_msgs/action/NavigateToPose",
        }
    return {
        "topic": f"{topics}/move_base_simple/goal",
        "cancel_topic": f"{topics}/move_base/cancel",
        "action": f"{topics}/move_base",
        "action_type": "move_base_msgs/MoveBaseAction",
    }


class PauseErrands:
    """Pauses the errands of a robot while STOP is active or an operator has control.

    A robot does not know who has control of it, so it would begin its next errand under
    an operator who has taken control and not driven yet. A module of robots.

    Args:
        robot: The robot.
        bridge: Its bridge.
        topic: The topic that pauses its errands, of type ``std_msgs/Empty``.

    """

    def __init__(self, robot: "Robot", bridge: "Bridge", topic: str) -> None:
        self._robot = robot
        self._bridge = bridge
        self.topic = topic
        self._pausing: asyncio.Task[None] | None = None

    @property
    def is_idle(self) -> bool:
        """Whether it leaves the errands to the robot."""
        return self._pausing is None or self._pausing.done()

    def on_report(self, report: RobotReport) -> None:
        """Begin to pause, when somebody has control or STOP is active."""
        if _needs_pause(report) and self.is_idle:
            self._pausing = spawn(self._pause_on())

    async def _pause_on(self) -> None:
        while (report := self._robot.report) is not None and _needs_pause(report):
            with contextlib.suppress(BridgeClosed):  # sent again after REPEAT
                self._bridge.publish(self.topic, {}, "std_msgs/Empty")
            await asyncio.sleep(REPEAT)


def _needs_pause(report: RobotReport) -> bool:
    return report.latched or report.changing or report.holder is not None
