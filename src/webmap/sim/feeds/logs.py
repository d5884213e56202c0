"""Log messages of the robots' nodes: start, goals, plans, collisions, the battery."""

from dataclasses import dataclass

from webmap.sim.feeds.health import LOW
from webmap.sim.graph_node import GraphNode
from webmap.sim.navigator import GoalState, SimGoal
from webmap.sim.robot import SimRobot

TOPIC = "/rosout"
INFO, WARN, ERROR = "info", "warn", "error"
_ROS1 = {INFO: 2, WARN: 4, ERROR: 8}
_ROS2 = {INFO: 20, WARN: 30, ERROR: 40}

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
            TOPIC, "rcl_interfaces/Log" if ros2 else "rosgraph_msgs/Log"
        )

    def publish(self) -> None:
        """Publish the news since the last call, if the topic has subscribers."""
        world = self._node.world
        has_subscriber = self._node.graph.is_wanted(TOPIC)
        begins, self._had_subscriber = (
            has_subscriber and not self._had_subscriber,
            has_subscriber,
        )
        pairs = zip(world.navigators, self._before, strict=True)
        for navigator, before in pairs:
            robot = navigator.robot
            if begins:
                charge = f"{100 * robot.charge:.0f} %"
                self._log(robot, INFO, "base", f"ready, the battery is at {charge}")
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
                "header": messages.dialect.header(TOPIC, now, ""),
                "level": _ROS1[level],
                "name": f"{robot.topics}/{node}",
                "msg": text,
                "file": "simulator",
                "function": "step",
                "line": 1,
                "topics": [],
            }
        self._node.publish(TOPIC, message)


def _news(
    robot: SimRobot, goal: SimGoal | None, paths: int, before: _Before
) -> list[Line]:
    """Return the log messages that are due, and remember them."""
    lines: list[Line] = []
    if goal is not before.goal:
        if before.goal is not None:
            state, why = before.goal.state, before.goal.text
            level = ERROR if state is GoalState.ABORTED else INFO
            lines.append((level, "navigator", f"the goal {state.value}: {why}"))
        if goal is not None:
            at = f"({goal.pose.x:.2f}, {goal.pose.y:.2f})"
            lines.append((INFO, "navigator", f"a goal at {at}"))
    if paths != before.paths and goal is not None and goal is before.goal:
        lines.append((INFO, "planner", "a new path"))
    if robot.bumped and not before.bumped:
        lines.append((WARN, "base", "the path is blocked"))
    low = robot.charge < LOW
    if low and not before.low:
        lines.append((WARN, "base", f"the battery is at {100 * robot.charge:.0f} %"))
    before.goal, before.paths, before.bumped, before.low = (
        goal,
        paths,
        robot.bumped,
        low,
    )
    return lines
