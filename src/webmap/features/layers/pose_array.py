"""Arrays of poses, such as the particles of a localisation."""

import math

import msgspec

from webmap.base.geometry import Pose
from webmap.modules.declaration import TopicKind, layer
from webmap.modules.drawing import thinned
from webmap.modules.layer_options import Count, Frame, Metres
from webmap.modules.robot_layer import RobotLayer
from webmap.ros.messages import PoseMsg, Stamped
from webmap.ros.tf import Transform
from webmap.scene import svg


class PoseArrayMsg(Stamped, frozen=True, kw_only=True):
    """``geometry_msgs/PoseArray``."""

    poses: list[PoseMsg]


class ParticleMsg(msgspec.Struct, frozen=True, gc=False):
    """``nav2_msgs/Particle``."""

    pose: PoseMsg
    weight: float = 0.0


class ParticleCloudMsg(Stamped, frozen=True, kw_only=True):
    """``nav2_msgs/ParticleCloud``."""

    particles: list[ParticleMsg]

    @property
    def poses(self) -> list[PoseMsg]:
        """The poses, as in ``geometry_msgs/PoseArray``."""
        return [particle.pose for particle in self.particles]


POSES, PARTICLES = "geometry_msgs/PoseArray", "nav2_msgs/ParticleCloud"


@layer(
    POSES,
    PARTICLES,
    view={POSES: PoseArrayMsg, PARTICLES: ParticleCloudMsg},
    kinds=[
        TopicKind("particles", most=1, types=(PARTICLES,)),
        TopicKind(
            "particles",
            {r"particle_?cloud\Z": "the usual name"},
            most=1,
            types=(POSES,),
        ),
        TopicKind("poses", types=(POSES,)),
    ],
    switch="Poses",
    rank=50,
)
class PoseArray(RobotLayer):
    """An arrow for each of many poses, such as ``/particlecloud`` of AMCL in ROS 1.

    Style them by CSS: ``.posearray > .arrow``.
    """

    only_draws = True

    in_plane = True

    type: str = POSES
    """``geometry_msgs/PoseArray`` or ``nav2_msgs/ParticleCloud``, the type of
    ``/particle_cloud`` in Nav2.
    """

    frame: Frame = "map"
    """``"robot"`` for poses in the robot's own frame."""

    length: Metres = 0.2
    """Length of an arrow, in metres."""

    max_poses: Count = 500
    """The greatest number of poses that are drawn, evenly chosen."""

    throttle: int = 500
    age_limit: float = 10.0

    def build(self) -> None:
        """Make the path of all arrows."""
        self._message: PoseArrayMsg | ParticleCloudMsg | None = None
        self.arrows = self.add(
            svg.path(class_="arrow", fill="#d03a7c", fill_opacity=0.7)
        )

    @property
    def poses(self) -> list[Pose]:
        """All newest poses.

        Raises:
            ProtocolError: If a pose is not finite; only the drawn poses were checked
                before.
        """
        given = self._message.poses if self._message is not None else []
        return [pose.usable for pose in given]

    def read(
        self, message: PoseArrayMsg | ParticleCloudMsg
    ) -> tuple[PoseArrayMsg | ParticleCloudMsg, list[Pose]]:
        """Return the message and the poses to draw.

        Raises:
            ProtocolError: If a pose is not finite.
        """
        given = message.poses
        # Only these are checked: 20,000 would delay the other robots by 0.1 s.
        chosen = [given[index] for index in thinned(len(given), self.max_poses)]
        return message, [pose.usable for pose in chosen]

    def draw(
        self, found: tuple[PoseArrayMsg | ParticleCloudMsg, list[Pose]], at: Transform
    ) -> None:
        """Draw the arrows; nothing without poses."""
        self._message, poses = found
        self.arrows.set(d="".join(arrow(pose, self.length) for pose in poses) or None)


def arrow(pose: Pose, length: float) -> str:
    """Return the path of a narrow triangle that begins at a pose and points along x."""
    cos, sin = math.cos(pose.yaw) * length, math.sin(pose.yaw) * length
    # From one corner of its base to the tip, and back to the other corner.
    x, y = pose.x - 0.12 * sin, pose.y + 0.12 * cos
    to_tip = (cos + 0.12 * sin, sin - 0.12 * cos)
    back = (-cos + 0.12 * sin, -sin - 0.12 * cos)
    return (
        f"M{x:.3f} {y:.3f}l{to_tip[0]:.3f} {to_tip[1]:.3f}{back[0]:+.3f}{back[1]:+.3f}z"
    )
