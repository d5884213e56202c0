"""What robots report about themselves: diagnostics, log messages, markers."""

import math
from dataclasses import dataclass
from typing import Any

from webmap.base.geometry import Pose
from webmap.sim.messages import Feed, GraphNode, Message, pose
from webmap.sim.navigator import GoalState, SimGoal
from webmap.sim.robot import SimRobot

DIAGNOSTICS = "/diagnostics"
OK, WARN, ERROR = 0, 1, 2
LOW, EMPTY = 0.3, 0.1
"""Charges below which the battery warns, and below which it fails."""


class Health:
    """Publishes ``diagnostic_msgs/DiagnosticArray``, a message for each robot."""

    def __init__(self, node: GraphNode) -> None:
        self._node = node

    def start(self) -> None:
        """Advertise the topic."""
        self._node.advertise(DIAGNOSTICS, "diagnostic_msgs/DiagnosticArray")

    def publish(self) -> None:
        """Publish the status of every part, if the topic has subscribers."""
        graph = self._node.graph
        if not graph.is_wanted(DIAGNOSTICS):
            return
        dialect = self._node.messages.dialect
        for robot in self._node.world.robots:
            header = dialect.header(DIAGNOSTICS, graph.clock(), "")
            status = parts(robot, "" if dialect.is_ros2 else robot.frames)
            self._node.publish(DIAGNOSTICS, {"header": header, "status": status})


def parts(robot: SimRobot, space: str) -> list[Message]:
    """Return ``diagnostic_msgs/DiagnosticStatus`` of a robot's parts.

    Args:
        robot: The robot.
        space: Prefix that updaters add to the names of their nodes. In ROS 1 it is the
            namespace: ``robot_0/``. In ROS 2 it is empty, unless the parameter
            ``diagnostic_updater.use_fqn`` is set.

    """
    charge = robot.charge
    battery = ERROR if charge < EMPTY else WARN if charge < LOW else OK
    blocked = robot.bumped
    return [
        _part(
            robot,
            f"{space}base: Motors",
            WARN if blocked else OK,
            "blocked" if blocked else "running" if robot.twist.vx else "standing",
            {
                "linear velocity (m/s)": f"{robot.twist.vx:.2f}",
                "angular velocity (rad/s)": f"{robot.twist.wz:.2f}",
                "travelled (m)": f"{robot.travelled:.1f}",
            },
        ),
        _part(
            robot,
            f"{space}base: Battery",
            battery,
            f"{100 * charge:.0f} %{'' if battery == OK else ', charge it'}",
            {"charge": f"{charge:.3f}"},
        ),
        _part(robot, f"{space}laser: Frequency", OK, "10 Hz", {}),
    ]


def _part(
    robot: SimRobot, name: str, level: int, message: str, values: dict[str, str]
) -> Message:
    return {
        "level": level,
        "name": name,
        "message": message,
        "hardware_id": robot.name or "robot",
        "values": [{"key": key, "value": value} for key, value in values.items()],
    }


ROSOUT = "/rosout"
_INFO, _WARN, _ERROR = "info", "warn", "error"
_ROS1 = {_INFO: 2, _WARN: 4, _ERROR: 8}
_ROS2 = {_INFO: 20, _WARN: 30, _ERROR: 40}

Line = tuple[str, str, str]
"""A level, the last part of a node's name, and the text."""


@dataclass(slots=True)
class _Before:
    goal: SimGoal | None = None
    paths: int = 0
    bumped: bool = False
    low: bool = False


class Logs:
    """Publishes ``rosgraph_msgs/Log``, which ROS 2 calls ``rcl_interfaces/Log``."""

    def __init__(self, node: GraphNode) -> None:
        self._node = node
        self._before = [_Before() for _ in node.world.robots]
        self._had_subscriber = False

    def start(self) -> None:
        """Advertise the topic."""
        ros2 = self._node.messages.dialect.is_ros2
        self._node.advertise(
            ROSOUT, "rcl_interfaces/Log" if ros2 else "rosgraph_msgs/Log"
        )

    def publish(self) -> None:
        """Publish the news since the last call, if the topic has subscribers."""
        world = self._node.world
        has_subscriber = self._node.graph.is_wanted(ROSOUT)
        begins, self._had_subscriber = (
            has_subscriber and not self._had_subscriber,
            has_subscriber,
        )
        pairs = zip(world.navigators, self._before, strict=True)
        for navigator, before in pairs:
            robot = navigator.robot
            if begins:
                charge = f"{100 * robot.charge:.0f} %"
                self._log(robot, _INFO, "base", f"ready, the battery is at {charge}")
            lines = _news(robot, navigator.goal, navigator.path_changes, before)
            for line in lines if has_subscriber else ():
                self._log(robot, *line)

    def _log(self, robot: SimRobot, level: str, node: str, text: str) -> None:
        messages = self._node.messages
        now = self._node.graph.clock()
        if messages.dialect.is_ros2:
            name = f"{robot.name}.{node}".lstrip(".")
            where = {"file": "simulator", "function": "step", "line": 1}
            message = {
                "stamp": messages.dialect.time(now),
                "level": _ROS2[level],
                "name": name,
                "msg": text,
                **where,
            }
        else:
            message = {
                "header": messages.dialect.header(ROSOUT, now, ""),
                "level": _ROS1[level],
                "name": f"{robot.topics}/{node}",
                "msg": text,
                "file": "simulator",
                "function": "step",
                "line": 1,
                "topics": [],
            }
        self._node.publish(ROSOUT, message)


def _news(
    robot: SimRobot, goal: SimGoal | None, paths: int, before: _Before
) -> list[Line]:
    """Return the log messages that are due, and remember them."""
    lines: list[Line] = []
    if goal is not before.goal:
        if before.goal is not None:
            state, why = before.goal.state, before.goal.text
            level = _ERROR if state is GoalState.ABORTED else _INFO
            lines.append((level, "navigator", f"the goal {state.value}: {why}"))
        if goal is not None:
            at = f"({goal.pose.x:.2f}, {goal.pose.y:.2f})"
            lines.append((_INFO, "navigator", f"a goal at {at}"))
    if paths != before.paths and goal is not None and goal is before.goal:
        lines.append((_INFO, "planner", "a new path"))
    if robot.bumped and not before.bumped:
        lines.append((_WARN, "base", "the path is blocked"))
    low = robot.charge < LOW
    if low and not before.low:
        lines.append((_WARN, "base", f"the battery is at {100 * robot.charge:.0f} %"))
    before.goal, before.paths, before.bumped, before.low = (
        goal,
        paths,
        robot.bumped,
        low,
    )
    return lines


ARROW, CYLINDER, TEXT = 0, 3, 9
ADD, DELETE = 0, 2
SIGHT = 6.0
"""Distance at which a robot detects another one, in metres."""

SEEN_FOR = 1.0
"""Seconds for which a detected robot stays marked."""

GREEN, ORANGE, INK = (0.1, 0.6, 0.3), (0.9, 0.45, 0.1), (0.2, 0.25, 0.3)


class MarkerFeed:
    """Makes ``visualization_msgs/MarkerArray`` in the map's frame."""

    def __init__(self, node: GraphNode) -> None:
        self._node = node
        type = "visualization_msgs/MarkerArray"
        self.feed = Feed("markers", type, 0.2, "", self._make)

    def _make(self, index: int) -> Message:
        node = self._node
        topic = f"{node.world.robots[index].topics}/{self.feed.topic}"
        header = node.messages.dialect.header(topic, node.graph.clock(), "map")
        marks = [*self._goal(index), *self._seen(index)]
        return {"markers": [{"header": header, **mark} for mark in marks]}

    def _goal(self, index: int) -> list[Message]:
        world = self._node.world
        goal = world.navigators[index].goal
        if goal is None:
            return [
                self._mark("goal", number, type, Pose(), action=DELETE)
                for number, type in enumerate((ARROW, TEXT))
            ]
        at = goal.pose
        left = math.hypot(
            at.x - world.robots[index].pose.x, at.y - world.robots[index].pose.y
        )
        beside = Pose(at.x, at.y + 0.4)
        return [
            self._mark("goal", 0, ARROW, at, (0.7, 0.12, 0.12), GREEN),
            self._mark("goal", 1, TEXT, beside, (0, 0, 0.3), GREEN, f"{left:.1f} m"),
        ]

    def _seen(self, index: int) -> list[Message]:
        world = self._node.world
        here = world.robots[index].pose
        marks = []
        for number, robot in enumerate(world.robots):
            at = Pose(robot.pose.x, robot.pose.y)
            if number == index or math.hypot(at.x - here.x, at.y - here.y) > SIGHT:
                continue
            size = 2 * robot.options.radius + 0.1
            marks.append(
                self._mark(
                    "seen",
                    number,
                    CYLINDER,
                    at,
                    (size, size, 0.5),
                    ORANGE,
                    alpha=0.35,
                    lifetime=SEEN_FOR,
                )
            )
        return marks

    def _mark(
        self,
        space: str,
        number: int,
        type: int,
        at: Pose,
        scale: tuple[float, float, float] = (1, 1, 1),
        color: tuple[float, float, float] = INK,
        text: str = "",
        *,
        action: int = ADD,
        alpha: float = 1.0,
        lifetime: float = 0.0,
    ) -> dict[str, Any]:
        dialect = self._node.messages.dialect
        texture: Message = {}
        mesh_file: Message = {}
        if dialect.is_ros2:
            image = {"header": dialect.header("", 0.0, ""), "format": "", "data": b""}
            texture = {"texture_resource": "", "texture": image, "uv_coordinates": []}
            mesh_file = {"mesh_file": {"filename": "", "data": b""}}
        return {
            "ns": space,
            "id": number,
            "type": type,
            "action": action,
            "pose": pose(at),
            "scale": dict(zip("xyz", map(float, scale), strict=True)),
            "color": dict(zip("rgba", (*color, alpha), strict=True)),
            "lifetime": dialect.time(lifetime),
            "frame_locked": False,
            "points": [],
            "colors": [],
            **texture,
            "text": text,
            "mesh_resource": "",
            **mesh_file,
            "mesh_use_embedded_materials": False,
        }
