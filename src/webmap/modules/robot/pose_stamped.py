"""A pose that somebody publishes, such as a goal, as an arrow."""

import math
from typing import TYPE_CHECKING

from webmap.core.frames import frames_of
from webmap.core.layer_names import label
from webmap.core.placed import Placed
from webmap.core.refusals import refusing
from webmap.errors import ConfigError
from webmap.geometry import Pose
from webmap.ros.bridge import Bridge
from webmap.ros.messages import PoseStampedMsg
from webmap.scene import svg

if TYPE_CHECKING:
    from webmap.core.robot import Robot


class PoseStamped:
    """Draws a ``geometry_msgs/PoseStamped`` as an arrow that points along its x.

    Style it by CSS: ``.posestamped > .arrow``; one of several by its ``name``, which is
    a class too: ``.posestamped.goal > .arrow``. The class ``goal`` is for where the
    robot is sent: such an arrow is hidden as long as the goal tool shows a goal of the
    robot, which it also is, and it goes when the robot gets there.

    Args:
        robot: The robot that it is about.
        bridge: The link to the ROS system that has the topic.
        topic: The topic: ``/move_base/current_goal``, ``/goal_pose``.
        name: A further class.
        frame: ``"map"``, or ``"robot"`` for a pose in the robot's own frame.
        length: How long the arrow is, in metres.
        reached: How near the robot is, in metres, when it got to a pose named
            ``goal``.
        throttle: The least time between two messages, in milliseconds.
        age_limit: Seconds after which it is drawn as old.

    Raises:
        ConfigError: If a length makes no sense.

    """

    def __init__(
        self,
        robot: "Robot",
        bridge: Bridge,
        topic: str,
        *,
        name: str = "",
        frame: str = "map",
        length: float = 0.6,
        reached: float = 0.4,
        throttle: int = 200,
        age_limit: float = 60.0,
    ) -> None:
        for what, value in (("length", length), ("reached", reached)):
            if not (math.isfinite(value) and value > 0):
                raise ConfigError(f"{what} must be metres above 0, got {value}")
        self.robot = robot
        self.topic = topic
        self.length = length
        self.reached = reached
        self.age_limit = age_limit
        self.pose: Pose | None = None
        """The newest pose, as the message has it."""
        self.arrow = svg.path(class_="arrow", fill="#b3261e", fill_opacity=0.85)
        self.arrow.set(d=arrow(length))
        self._ends = name == "goal" and frame == "map"
        self._goes_to: Pose | None = None
        """What is drawn until the robot gets there."""
        self._count = 0
        self._placed = Placed(
            robot, self.arrow, class_=f"posestamped {name}".strip(), frame=frame
        )
        self.svg = self._placed.svg
        label(self.svg, topic, robot)
        self.svg.set(visibility="hidden")
        self._bridge = bridge
        bridge.subscribe(
            topic,
            refusing(robot, topic, self.on_pose),
            "geometry_msgs/PoseStamped",
            throttle=throttle,
            decode=PoseStampedMsg,
        )

    def on_pose(self, message: PoseStampedMsg) -> None:
        """Draw a pose in place of the one before.

        Raises:
            ProtocolError: If it is not finite or turns nowhere.

        """
        pose = message.pose.usable
        self._placed.stand_in(message.frame_id, message.stamp)
        self.pose = pose
        self._goes_to = pose if self._ends and self._in_map(message.frame_id) else None
        self.arrow.set_pose(pose.x, pose.y, pose.yaw)
        self._count += 1
        # By this the page knows one that the goal tool has shown already.
        self.svg.set("data-pose", f"{self.topic} {self._count}")
        self.svg.set(visibility=None)
        self.svg.set_age(self._bridge.lag, limit=self.age_limit)

    def on_odometry_update(self) -> None:
        """Keep it where it is while the robot goes along, until that gets there."""
        self._placed.follow()
        if self._goes_to is not None and self._is_there(self._goes_to):
            self._goes_to = None
            self.svg.set(visibility="hidden")

    def _is_there(self, pose: Pose) -> bool:
        x, y = self.robot.whereabouts.placing.apply(pose.x, pose.y)
        at = self.robot.position
        return math.dist((x, y), (at.x, at.y)) < self.reached

    def _in_map(self, frame_id: str) -> bool:
        """Tell whether a frame is that of the robot's poses, so that both compare."""
        tf = self.robot.tf
        if tf is None:
            return frame_id.strip("/") in ("", "map")
        buffer = frames_of(tf["bridge"], tf["namespace"]).buffer
        return buffer.name(frame_id, tf["namespace"]) in ("", tf["map_frame"])


def arrow(length: float) -> str:
    """Return the path of an arrow along x, whose head is a third of it."""
    shaft, half = length * 2 / 3, length / 20
    wide = length / 6
    return (
        f"M0 {half:.3f}L{shaft:.3f} {half:.3f}L{shaft:.3f} {wide:.3f}L{length:.3f} 0"
        f"L{shaft:.3f} {-wide:.3f}L{shaft:.3f} {-half:.3f}L0 {-half:.3f}z"
    )
