"""Single poses, such as a goal, drawn as an arrow."""

import math

from webmap.base.geometry import Pose
from webmap.modules.declaration import TopicKind, layer
from webmap.modules.layer_options import Frame, Metres
from webmap.modules.robot_layer import RobotLayer
from webmap.ros.messages import PoseStampedMsg
from webmap.ros.tf import Transform
from webmap.scene import svg


@layer(
    "geometry_msgs/PoseStamped",
    view=PoseStampedMsg,
    kinds=[
        TopicKind(
            "goal",
            {
                r"/current_goal\Z": "the current goal of move_base",
                r"/goal_pose\Z": "where RViz sends Nav2",
                r"/move_base_simple/goal\Z": "where RViz sends move_base",
            },
            most=1,
            options={"name": "goal"},
        ),
        TopicKind("pose"),
    ],
    switch="Poses",
    rank=80,
)
class PoseStamped(RobotLayer):
    """An arrow that points along x of a pose, such as ``/goal_pose``.

    With ``name="goal"`` it is the robot's goal: it is hidden while the goal tool shows
    a goal of the robot, so that no goal is drawn twice, and it is removed when the
    robot reaches it.

    Style it by CSS: ``.posestamped > .arrow``, and one of several by its name:
    ``.posestamped.goal > .arrow``.
    """

    only_draws = True

    in_plane = True

    frame: Frame = "map"
    """``"robot"`` for a pose in the robot's own frame."""

    length: Metres = 0.6
    """Length of the arrow, in metres."""

    reached: Metres = 0.4
    """Distance in metres within which the robot has reached a pose named ``goal``."""

    def build(self) -> None:
        """Make the arrow, hidden until there is a pose."""
        self.pose: Pose | None = None
        """The newest pose, in the message's frame."""
        self.arrow = self.add(
            svg.path(class_="arrow", fill="#b3261e", fill_opacity=0.85)
        )
        self.arrow.set(d=arrow(self.length))
        self.svg.set(visibility="hidden")
        self._ends = self.name == "goal" and self.frame == "map"
        self._goal_pose: Pose | None = None
        """The goal that is drawn until the robot reaches it."""
        self._count = 0

    @property
    def shows_own_goal(self) -> bool:
        """Whether the map shows a goal that the robot has not reached."""
        return self._goal_pose is not None

    def read(self, message: PoseStampedMsg) -> tuple[Pose, str]:
        """Return a pose that can be drawn, and its frame.

        Raises:
            ProtocolError: If it is not finite or its quaternion is no rotation.
        """
        return message.pose.usable, message.frame_id

    def draw(self, found: tuple[Pose, str], at: Transform) -> None:
        """Move the arrow to the pose."""
        self.pose, frame_id = pose, _ = found
        self._goal_pose = pose if self._ends and self.in_map(frame_id) else None
        self.arrow.set_pose(pose.x, pose.y, pose.yaw)
        self._count += 1
        # Identifies a goal that the goal tool has shown already.
        self.svg.set("data-pose", f"{self.topic} {self._count}")
        self.svg.set(visibility=None)

    def on_odometry_update(self) -> None:
        """Hide a goal when the robot reaches it."""
        if self._goal_pose is not None and self._is_there(self._goal_pose):
            self._goal_pose = None
            self.svg.set(visibility="hidden")

    def _is_there(self, pose: Pose) -> bool:
        x, y = self.robot.pose_source.common_from_own.apply(pose.x, pose.y)
        at = self.robot.position
        return math.dist((x, y), (at.x, at.y)) < self.reached


def arrow(length: float) -> str:
    """Return the path of an arrow along x, whose head is a third of its length."""
    shaft, half = length * 2 / 3, length / 20
    wide = length / 6
    return (
        f"M0 {half:.3f}L{shaft:.3f} {half:.3f}L{shaft:.3f} {wide:.3f}L{length:.3f} 0"
        f"L{shaft:.3f} {-wide:.3f}L{shaft:.3f} {-half:.3f}L0 {-half:.3f}z"
    )
