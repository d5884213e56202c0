"""The ROS node of the simulated robots: the world on one side, topics on the other."""

import logging
from collections.abc import Callable
from functools import partial
from typing import Any

from webmap.base.geometry import Pose, Twist
from webmap.ros.rosbridge.server.dialect import Quirks
from webmap.ros.rosbridge.server.encode import Publication
from webmap.ros.rosbridge.server.graph import Graph, Respond
from webmap.sim.actions import ActionlibServer, NavigateToPose
from webmap.sim.feeds import Feeds
from webmap.sim.feeds.sensors import (
    CAMERA_FRAME,
    CAMERA_POSE,
    SONAR_FRAME,
    SONAR_POSE,
)
from webmap.sim.messages import NODE, GraphNode, Message
from webmap.sim.navigator import SimGoal
from webmap.sim.robot import SimRobot
from webmap.sim.scanner import OVER, mount, overhead
from webmap.sim.world import World

log = logging.getLogger("webmap.sim")

IMAGE = "camera/image_raw"
"""Name of the camera's image topic, in the robot's namespace."""

CAMERA = f"{IMAGE}/compressed"
"""Topic of its pictures, which come as JPEG only."""

STEP = 0.025
"""Seconds of one step of the world."""

_ODOMETRY_EVERY = 2
_SCAN_EVERY = 4
_STATUS_EVERY = 8
_SLOW_EVERY = 40


class RobotsNode(GraphNode):
    """Publishes the topics of robots, and passes commands to them.

    Args:
        world: The robots.
        graph: The graph with their topics.
        twist: ``Twist`` or ``TwistStamped``, the type of ``cmd_vel``.
        quirks: Quirks of the server, for the services that may hang.
        extras: Whether robots have more than odometry, a scan, a battery, a camera
            and plans.
        tilted: Whether their lasers are mounted upside down, and they have a depth
            camera whose cloud is in its optical frame.

    """

    def __init__(
        self,
        world: World,
        graph: Graph,
        twist: str,
        quirks: Quirks,
        *,
        extras: bool = True,
        tilted: bool = False,
    ) -> None:
        super().__init__(world, graph, tilted=tilted)
        self._twist = twist
        self._quirks = quirks
        self._steps = 0
        self._paths_seen = [0 for _ in world.robots]
        self._feeds = Feeds(self, STEP) if extras else None
        if self._feeds is not None:
            self.messages.mounted[SONAR_FRAME] = mount(SONAR_POSE.x, 0.15)
        if tilted:
            self.messages.mounted["base_laser"] @= OVER
            self.messages.mounted[CAMERA_FRAME] = CAMERA_POSE

    def start(self) -> None:
        """Advertise topics, subscribe to topics and serve services."""
        self._publish_fixed()
        self.advertise("/tf", "tf2_msgs/TFMessage")
        for index, robot in enumerate(self.world.robots):
            self._start_robot(index, robot.topics)
        if self._feeds is not None:
            self._feeds.start()

    def _start_robot(self, index: int, prefix: str) -> None:
        self.advertise(f"{prefix}/odom", "nav_msgs/Odometry")
        self.advertise(f"{prefix}/base_scan", "sensor_msgs/LaserScan")
        self.advertise(f"{prefix}/battery_state", "sensor_msgs/BatteryState")
        self.advertise(f"{prefix}/plan", "nav_msgs/Path")
        self.advertise(f"{prefix}/{CAMERA}", "sensor_msgs/CompressedImage")
        self.subscribe(
            f"{prefix}/cmd_vel",
            f"geometry_msgs/{self._twist}",
            partial(self._on_twist, index),
        )
        goals = ["move_base_simple/goal"]
        if self.graph.schema.dialect.is_ros2:
            goals.append("goal_pose")
            NavigateToPose(self, index, prefix).start()
        else:
            ActionlibServer(self, index, prefix).start()
        for name in goals:
            self.subscribe(
                f"{prefix}/{name}",
                "geometry_msgs/PoseStamped",
                partial(self._on_simple_goal, index),
            )
        if self.world.errands.has(index):
            self.subscribe(
                f"{prefix}/errands/pause",
                "std_msgs/Empty",
                lambda _: self.world.pause_errands(index),
            )
        self.graph.serve(
            self,
            f"{prefix}/stop",
            "std_srvs/Trigger",
            partial(self._on_stop, index),
            node=NODE,
        )

    def step(self) -> None:
        """Advance the world by one step, and publish the messages that are due."""
        self.world.step(STEP)
        self._steps += 1
        if self._steps % _ODOMETRY_EVERY == 0:
            self._publish_poses()
        if self._steps % _SCAN_EVERY == 0:
            self._publish_scans()
        if self._steps % _STATUS_EVERY == 0:
            for report in self.on_step:
                report()
            self._publish_views()
        slow = self._steps % _SLOW_EVERY == 0
        if slow:
            self._publish_each("battery_state", self.messages.battery)
        self._publish_paths(all_of_them=slow)
        if self._feeds is not None:
            self._feeds.publish(self._steps)

    def believed(self, index: int) -> Pose:
        """Return the estimated pose of a robot on the map."""
        if self._feeds is None:
            return self.world.robots[index].pose
        return self._feeds.localizations.believed(index)

    # From the graph.

    def _on_twist(self, index: int, publication: Publication) -> None:
        message = publication.message
        if self._twist == "TwistStamped":
            message = message["twist"]
        twist = Twist(vx=message["linear"]["x"], wz=message["angular"]["z"])
        if not self.world.command(index, twist):
            log.warning("robot_%d: refused %s", index, twist)

    def _on_simple_goal(self, index: int, publication: Publication) -> None:
        at = self.target(publication.message, index)
        if at is not None:
            self.world.send_goal(index, SimGoal(at))

    def _on_stop(self, index: int, _: dict[str, Any], respond: Respond) -> None:
        if self._quirks.hanging_stop:
            return
        self.world.stop(index)
        respond({"success": True, "message": "stopped"})

    # To the graph.

    def _publish_fixed(self) -> None:
        now = self.graph.clock()
        self.advertise("/map", "nav_msgs/OccupancyGrid", latch=True)
        self.publish("/map", self.messages.grid("/map", now, self.world.plan))
        self.advertise("/tf_static", "tf2_msgs/TFMessage", latch=True)
        transforms = self.messages.static_transforms(
            "/tf_static", now, self.world.robots
        )
        self.publish("/tf_static", transforms)

    def _publish_poses(self) -> None:
        self._publish_each("odom", self.messages.odometry)
        if self.graph.is_wanted("/tf"):
            now, robots = self.graph.clock(), self.world.robots
            believed = [self.believed(index) for index in range(len(robots))]
            message = self.messages.transforms("/tf", now, robots, believed)
            self.publish("/tf", message)

    def _publish_scans(self) -> None:
        robots = self.world.robots
        subscribed = [
            i
            for i, robot in enumerate(robots)
            if self.graph.is_wanted(f"{robot.topics}/base_scan")
        ]
        if not subscribed:
            return
        now = self.graph.clock()
        options = self.world.options.scanner
        for i, ranges in zip(subscribed, self.world.sweep(subscribed), strict=True):
            if self.tilted:
                ranges = overhead(ranges)
            topic = f"{robots[i].topics}/base_scan"
            self.publish(
                topic, self.messages.scan(topic, now, robots[i], options, ranges)
            )

    def _publish_views(self) -> None:
        for i, robot in enumerate(self.world.robots):
            topic = f"{robot.topics}/{CAMERA}"
            if self.graph.is_wanted(topic):
                jpeg = self.world.look(i)
                now = self.graph.clock()
                self.publish(topic, self.messages.camera(topic, now, robot, jpeg))

    def _publish_each(
        self, name: str, make: Callable[[str, float, SimRobot], Message]
    ) -> None:
        now = self.graph.clock()
        for robot in self.world.robots:
            topic = f"{robot.topics}/{name}"
            if self.graph.is_wanted(topic):
                self.publish(topic, make(topic, now, robot))

    def _publish_paths(self, *, all_of_them: bool) -> None:
        for i, navigator in enumerate(self.world.navigators):
            is_new = navigator.path_changes != self._paths_seen[i]
            self._paths_seen[i] = navigator.path_changes
            topic = f"{navigator.robot.topics}/plan"
            repeats = all_of_them and navigator.path
            if (is_new or repeats) and self.graph.is_wanted(topic):
                now = self.graph.clock()
                self.publish(topic, self.messages.path(topic, now, navigator.path))
