"""Diagnostics of the parts of all robots, on one topic."""

from webmap.sim.graph_node import GraphNode
from webmap.sim.messages import Message
from webmap.sim.robot import SimRobot

TOPIC = "/diagnostics"
OK, WARN, ERROR = 0, 1, 2
LOW, EMPTY = 0.3, 0.1
"""Charges below which the battery warns, and below which it fails."""


class Health:
    """Publishes ``diagnostic_msgs/DiagnosticArray``, a message for each robot."""

    def __init__(self, node: GraphNode) -> None:
        self._node = node

    def start(self) -> None:
        """Advertise the topic."""
        self._node.advertise(TOPIC, "diagnostic_msgs/DiagnosticArray")

    def publish(self) -> None:
        """Publish the status of every part, if the topic has subscribers."""
        graph = self._node.graph
        if not graph.is_wanted(TOPIC):
            return
        dialect = self._node.messages.dialect
        for robot in self._node.world.robots:
            header = dialect.header(TOPIC, graph.clock(), "")
            status = parts(robot, "" if dialect.is_ros2 else robot.frames)
            self._node.publish(TOPIC, {"header": header, "status": status})


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
