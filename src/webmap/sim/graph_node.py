"""A ROS node of the simulator: a world, and the graph with its topics."""

import logging
from collections.abc import Callable
from typing import Any

from webmap.base.geometry import Pose
from webmap.ros.rosbridge.server.graph import Deliver, Graph
from webmap.sim.messages import Messages, read_pose
from webmap.sim.world import World

log = logging.getLogger("webmap.sim")

NODE = "/robots"


class GraphNode:
    """Publishes and subscribes for simulated robots.

    Args:
        world: The robots.
        graph: The ROS graph with their topics.
        tilted: Whether their lasers are mounted upside down, and they have a depth
            camera whose cloud is in its optical frame.

    """

    def __init__(self, world: World, graph: Graph, *, tilted: bool = False) -> None:
        self.world = world
        self.graph = graph
        self.tilted = tilted
        self.messages = Messages(graph.schema.dialect, nan=world.options.scanner.nan)
        self.on_step: list[Callable[[], None]] = []
        """Called five times a second: the actions report the state of their goals."""

    def target(self, pose_stamped: dict[str, Any], index: int) -> Pose | None:
        """Return a goal in the map's frame; None if its frame is unknown."""
        at = read_pose(pose_stamped["pose"])
        frame = pose_stamped["header"]["frame_id"].strip("/")
        robot = self.world.robots[index]
        if at is None or frame in ("", "map"):
            return at
        if frame in ("odom", f"{robot.frames}odom"):
            return robot.pose @ robot.odometry.inverse @ at
        log.warning("%s: a goal in an unknown frame %r", robot.name, frame)
        return None

    def publish(self, topic: str, message: dict[str, Any]) -> None:
        """Publish on a topic of this node."""
        self.graph.publish(self, topic, message)

    def advertise(self, topic: str, type_name: str, *, latch: bool = False) -> None:
        """Advertise a topic of this node."""
        self.graph.advertise(self, topic, type_name, node=NODE, latch=latch)

    def subscribe(self, topic: str, type_name: str, callback: Deliver) -> None:
        """Subscribe this node to a topic."""
        self.graph.subscribe(self, topic, callback, type_name, node=NODE)
