"""Many poses at once, such as the particles of a localisation."""

import math
from typing import TYPE_CHECKING

from webmap.core.layer_names import label
from webmap.core.placed import Placed, thinned
from webmap.core.refusals import refusing
from webmap.errors import ConfigError, ProtocolError
from webmap.geometry import Pose
from webmap.ros.bridge import Bridge
from webmap.ros.messages_poses import ParticleCloudMsg, PoseArrayMsg
from webmap.ros.names import split_type
from webmap.scene import svg

if TYPE_CHECKING:
    from webmap.core.robot import Robot

VIEWS: dict[str, type[PoseArrayMsg] | type[ParticleCloudMsg]] = {
    "geometry_msgs/PoseArray": PoseArrayMsg,
    "nav2_msgs/ParticleCloud": ParticleCloudMsg,
}


class PoseArray:
    """Draws an arrow for each pose of a topic, in the map's frame.

    Style them by CSS: ``.posearray > .arrow``.

    Args:
        robot: The robot that they are about.
        bridge: The link to the ROS system that has the topic.
        topic: The topic: ``/particlecloud`` of amcl in ROS 1, ``/particle_cloud`` in
            ROS 2.
        type: ``geometry_msgs/PoseArray`` or ``nav2_msgs/ParticleCloud``.
        frame: ``"map"``, or ``"robot"`` for poses in the robot's own frame.
        length: How long an arrow is, in metres.
        max_poses: How many are drawn at the most, evenly chosen.
        throttle: The least time between two messages, in milliseconds.
        age_limit: Seconds after which they are drawn as old.

    Raises:
        ConfigError: If the type has no poses, or a number makes no sense.

    """

    def __init__(
        self,
        robot: "Robot",
        bridge: Bridge,
        topic: str,
        *,
        type: str = "geometry_msgs/PoseArray",
        frame: str = "map",
        length: float = 0.2,
        max_poses: int = 500,
        throttle: int = 500,
        age_limit: float = 10.0,
    ) -> None:
        view = VIEWS.get(str(split_type(type)))
        if view is None:
            raise ConfigError(f"type is one of {', '.join(VIEWS)}, got {type!r}")
        if max_poses < 1:
            raise ConfigError(f"max_poses must be at least 1, got {max_poses}")
        if not (math.isfinite(length) and length > 0):
            raise ConfigError(f"length must be metres above 0, got {length}")
        self.robot = robot
        self.topic = topic
        self.length = length
        self.max_poses = max_poses
        self.age_limit = age_limit
        self._message: PoseArrayMsg | ParticleCloudMsg | None = None
        self.arrows = svg.path(class_="arrow", fill="#d03a7c", fill_opacity=0.7)
        self._placed = Placed(robot, self.arrows, class_="posearray", frame=frame)
        self.svg = self._placed.svg
        label(self.svg, topic, robot)
        self._bridge = bridge
        bridge.subscribe(
            topic,
            refusing(robot, topic, self.on_poses),
            type,
            throttle=throttle,
            decode=view,
        )

    @property
    def poses(self) -> list[Pose]:
        """The newest poses, all of them but those that turn nowhere.

        Raises:
            ProtocolError: If one of them is not finite, which only those that are drawn
                are known to be.

        """
        given = self._message.poses if self._message is not None else []
        return [pose.usable for pose in given if not pose.turns_nowhere]

    def on_poses(self, message: PoseArrayMsg | ParticleCloudMsg) -> None:
        """Draw poses in place of those before; none draw nothing.

        Raises:
            ProtocolError: If one that is to be drawn is not finite; or if one turns
                nowhere, but the others are drawn then.

        """
        given = message.poses
        # Only these are looked at: 20,000 would hold up the other robots for 0.1 s.
        chosen = [given[index] for index in thinned(len(given), self.max_poses)]
        poses = [pose.usable for pose in chosen if not pose.turns_nowhere]
        self._placed.stand_in(message.frame_id, message.stamp)
        self._message = message
        self.arrows.set(d="".join(arrow(pose, self.length) for pose in poses) or None)
        self.svg.set_age(self._bridge.lag, limit=self.age_limit)
        missing = len(chosen) - len(poses)
        if missing:
            raise ProtocolError(
                f"{missing} of {len(chosen)} poses have a quaternion of zeros, which "
                "turns nowhere, and are left out"
            )

    def on_odometry_update(self) -> None:
        """Keep them where they are while the robot goes along."""
        self._placed.follow()


def arrow(pose: Pose, length: float) -> str:
    """Return the path of a narrow triangle that begins at a pose and points along."""
    cos, sin = math.cos(pose.yaw) * length, math.sin(pose.yaw) * length
    # From one corner of its base to the tip, and back to the other corner.
    x, y = pose.x - 0.12 * sin, pose.y + 0.12 * cos
    to_tip = (cos + 0.12 * sin, sin - 0.12 * cos)
    back = (-cos + 0.12 * sin, -sin - 0.12 * cos)
    return (
        f"M{x:.3f} {y:.3f}l{to_tip[0]:.3f} {to_tip[1]:.3f}{back[0]:+.3f}{back[1]:+.3f}z"
    )
