"""What rosbags knows of the types of a ROS, and messages as bytes by that."""

import struct
from collections.abc import Iterator
from typing import TYPE_CHECKING

from webmap.bags.shapes import Shape, shapes_of
from webmap.bags.writing import Misfit, Objects
from webmap.errors import ConfigError
from webmap.ros.names import ros2_type
from webmap.sim.rosbridge.dialect import DialectName, canonical
from webmap.sim.rosbridge.schema import UnknownType

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

MORE = {
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "tf/msg/tfMessage": "geometry_msgs/TransformStamped[] transforms",
    "map_msgs/msg/OccupancyGridUpdate": (
        "std_msgs/Header header\nint32 x\nint32 y\nuint32 width\nuint32 height\n"
        "int8[] data"
    ),
}
"""Definitions that rosbags lacks, the same in ROS 1 and ROS 2."""

MORE_ROS1 = {
    "move_base_msgs/msg/MoveBaseGoal": "geometry_msgs/PoseStamped target_pose",
    "move_base_msgs/msg/MoveBaseFeedback": "geometry_msgs/PoseStamped base_position",
    "move_base_msgs/msg/MoveBaseResult": "",
    "move_base_msgs/msg/MoveBaseActionGoal": (
        "std_msgs/Header header\nactionlib_msgs/GoalID goal_id\n"
        "move_base_msgs/MoveBaseGoal goal"
    ),
    "move_base_msgs/msg/MoveBaseActionFeedback": (
        "std_msgs/Header header\nactionlib_msgs/GoalStatus status\n"
        "move_base_msgs/MoveBaseFeedback feedback"
    ),
    "move_base_msgs/msg/MoveBaseActionResult": (
        "std_msgs/Header header\nactionlib_msgs/GoalStatus status\n"
        "move_base_msgs/MoveBaseResult result"
    ),
}
"""Goals of move_base and how they go."""

MORE_ROS2 = {
    "nav2_msgs/msg/Particle": "geometry_msgs/Pose pose\nfloat64 weight",
    "nav2_msgs/msg/ParticleCloud": (
        "std_msgs/Header header\nnav2_msgs/Particle[] particles"
    ),
    "nav2_msgs/action/NavigateToPose_Feedback": (
        "geometry_msgs/PoseStamped current_pose\n"
        "builtin_interfaces/Duration navigation_time\n"
        "builtin_interfaces/Duration estimated_time_remaining\n"
        "int16 number_of_recoveries\nfloat32 distance_remaining"
    ),
    "nav2_msgs/action/NavigateToPose_FeedbackMessage": (
        "unique_identifier_msgs/UUID goal_id\n"
        "nav2_msgs/action/NavigateToPose_Feedback feedback"
    ),
}
"""Particles of Nav2's AMCL, and how goals of Nav2 go, from Humble on."""

_UNFIT = (struct.error, ValueError, TypeError, AssertionError, OverflowError)
"""What rosbags raises where a value does not fit its type."""

ROS1 = ("ROS1_NOETIC",)
ROS2 = ("ROS2_KILTED", "ROS2_JAZZY", "ROS2_IRON", "ROS2_HUMBLE", "ROS2_FOXY")
"""Releases whose types are known, in the order in which they are tried."""


class Way:
    """One way to make bytes of the messages of a type: as one release has it.

    Args:
        store: What rosbags knows of the types of that release.
        type_name: As rosbags has it: ``nav_msgs/msg/Odometry``.
        dialect: Whose bytes they are.

    Raises:
        UnknownType: If that release has no such type.

    """

    def __init__(
        self, store: "Typestore", type_name: str, dialect: DialectName
    ) -> None:
        shapes: dict[str, Shape] = shapes_of(store, type_name)
        self.store = store
        self.type_name = type_name
        self._objects = Objects(store.types, shapes)
        ros1 = dialect == "ros1"
        self._serialize = store.serialize_ros1 if ros1 else store.serialize_cdr

    def bytes_of(self, message: object) -> bytes:
        """Return a message as ROS itself puts it on its wire.

        Raises:
            Misfit: If the message does not fit the type as this release has it.

        """
        made = self._objects.object(canonical(self.type_name), message)
        try:
            return bytes(self._serialize(made, self.type_name))
        except _UNFIT as error:
            raise Misfit(str(error) or "it cannot be written") from None


class Types:
    """The types of one ROS, as its releases have them.

    Args:
        dialect: Which ROS.

    """

    def __init__(self, dialect: DialectName) -> None:
        self.dialect: DialectName = dialect
        self._stores: dict[str, Typestore] = {}

    def ways(self, type_name: str) -> Iterator[Way]:
        """Give the ways to write messages of a type; none if nobody knows it.

        Args:
            type_name: In the spelling of either ROS.

        """
        try:
            name = ros2_type(type_name)
        except ConfigError:
            return
        if "/action/" in type_name:
            name = name.replace("/msg/", "/action/")
        for release in ROS1 if self.dialect == "ros1" else ROS2:
            try:
                yield Way(self._store(release), name, self.dialect)
            except UnknownType:
                continue

    def _store(self, release: str) -> "Typestore":
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        if release not in self._stores:
            store = get_typestore(Stores[release])
            more = MORE_ROS1 if self.dialect == "ros1" else MORE_ROS2
            for name, text in {**MORE, **more}.items():
                if name not in store.fielddefs:
                    store.register(get_types_from_msg(text, name))
            self._stores[release] = store
        return self._stores[release]
