"""The results of discovery: robots, their names, topics, and why each was chosen."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple, TypeAlias, get_args

from webmap.config.checks import same_name
from webmap.config.motion import (
    InitialPoseConfig,
    MoveConfig,
    TwistConfig,
)
from webmap.config.robot import (
    CameraConfig,
    ModuleConfig,
    OdometryConfig,
    RobotConfig,
    TfConfig,
)
from webmap.discovery.tf_robots import MAP, WORLD
from webmap.ros.names import VIDEO, is_type, normalise_topic

TopicRole: TypeAlias = Literal[
    "odometry",
    "pose",
    "velocity",
    "scan",
    "battery",
    "plan",
    "goal",
    "action",
    "cancel",
    "initialpose",
    "map",
    "costmap",
    "camera",
    "cloud",
    "tf",
]
"""The purpose of a topic for a robot."""

ROLES: tuple[TopicRole, ...] = get_args(TopicRole)
"""Every role, in display order."""


ACTIONS = {
    "/_action/feedback": "nav2_msgs/action/NavigateToPose",
    "/goal": "move_base_msgs/MoveBaseAction",
}
"""Ends of topic names that identify actions, and the types of the actions."""


@dataclass(frozen=True, slots=True)
class FoundLayer:
    """A topic that can be drawn."""

    kind: str
    """The layer's name for such a topic."""

    topic: str
    type: str
    """The type as the bridge spells it."""

    rule: str = ""
    """The rule, as text."""


class Layers(NamedTuple):
    """The drawable topics of one robot, the best first."""

    drawn: tuple[FoundLayer, ...] = ()
    left_out: tuple[FoundLayer, ...] = ()
    """Drawable topics beyond the number that is drawn."""


@dataclass(frozen=True, slots=True)
class Guess:
    """One topic that fits a role, with its rule."""

    topic: str
    type: str
    """The type as the bridge spells it."""

    rule: str
    """The rule, as text."""


@dataclass(frozen=True, slots=True)
class FoundRobot:
    """A robot with the topics of each role, and the frames that place it."""

    name: str
    namespace: str
    """Namespace of its topics: ``/robot_0``; empty for a robot without a prefix."""

    guesses: Mapping[TopicRole, tuple[Guess, ...]] = field(default_factory=dict)
    """The topics that fit each role, the best first."""

    notes: tuple[str, ...] = ()
    """Remarks for a person about these guesses, in sentences."""

    base_frame: str = ""
    """The frame of its base, as received; empty if none was."""

    root_frame: str = ""
    """The frame that its base can be drawn in: a map, or the start of odometry."""

    above: tuple[str, ...] = ()
    """The parent frames of its base, the nearest first."""

    def first(self, role: TopicRole) -> Guess | None:
        """Return the best guess for a role, None if no topic fits."""
        found = self.guesses.get(role, ())
        return found[0] if found else None

    def topic(self, role: TopicRole) -> str:
        """Return the best topic for a role, empty if no topic fits."""
        found = self.first(role)
        return "" if found is None else found.topic

    def type_of(self, role: TopicRole) -> str:
        """Return the type of the best topic for a role, empty if unknown."""
        found = self.first(role)
        return "" if found is None else found.type

    @property
    def action(self) -> tuple[str, str] | None:
        """The name and the type of the action for goals, if there is one."""
        found = self.first("action")
        if found is None:
            return None
        for tail, type in ACTIONS.items():
            if found.topic.endswith(tail) and found.topic != tail:
                return found.topic.removesuffix(tail), type
        return None

    @property
    def tf_namespace(self) -> str | None:
        """The namespace of the topics with its frames; None if there are none."""
        return self.topic("tf").removesuffix("/tf") if self.topic("tf") else None

    @property
    def tf_alone(self) -> bool:
        """Whether its frames are the only source of its pose."""
        return self.topic("tf") != "" and not (
            self.topic("odometry") or self.topic("pose")
        )

    @property
    def tf(self) -> TfConfig | None:
        """The frames that it is drawn by; None if there are none."""
        if self.tf_namespace is None:
            return None
        return TfConfig(
            namespace=_resolved(self.tf_namespace),
            # Many robots have odometry, frames and no map: that is not a mistake.
            quiet=not self.tf_alone,
            base_frame=self.base_frame or None,
            map_frame=(self.tf_alone and self.root_frame) or self.map_frame,
        )

    @property
    def map_frame(self) -> str:
        """The frame of the map that it moves in, from its frames."""
        return self.root_frame if WORLD.match(self.root_frame) else MAP

    def config(self, bridge: str) -> RobotConfig:
        """Return the configuration of the robot with its best topics.

        Args:
            bridge: The name or the address of the robot's bridge.

        """
        scan, plan = self.topic("scan"), self.topic("plan")
        drawn = ModuleConfig(name="Path", args=[{"bridge": bridge}, plan])
        cameras = self.guesses.get("camera", ())
        return RobotConfig(
            name=self.name,
            bridge=bridge,
            odometry=self._odometry(),
            tf=self.tf,
            **self._motion(),
            scan=[scan] if scan else [],
            battery=self.topic("battery"),
            cameras=[_camera(guess) for guess in cameras],
            modules=[drawn] if plan else [],
        )

    def _odometry(self) -> OdometryConfig | None:
        where = self.first("odometry") or self.first("pose")
        if where is None:
            return None
        return OdometryConfig(topic=_resolved(where.topic), type=where.type or None)

    def _motion(self) -> dict[str, Any]:
        frame, action = self.map_frame, self.action
        velocity, pose = self.topic("velocity"), self.topic("initialpose")
        twist = move = place = None
        if velocity:
            type = self.type_of("velocity") or None
            twist = TwistConfig(topic=_resolved(velocity), type=type)
        if self.topic("goal") or action is not None:
            chosen = {} if action is None else {"action_type": action[1]}
            move = MoveConfig(
                topic=_resolved(self.topic("goal")),
                action=None if action is None else _resolved(action[0]),
                cancel_topic=_resolved(self.topic("cancel")) or None,
                frame=frame,
                **chosen,
            )
        if pose:
            place = InitialPoseConfig(topic=_resolved(pose), frame=frame)
        return {"twist": twist, "move": move, "initial_pose": place}


@dataclass(frozen=True, slots=True)
class Findings:
    """The robots and layers behind one bridge."""

    robots: tuple[FoundRobot, ...] = ()
    dialect: Literal["ros1", "ros2"] | None = None
    """The ROS that uses these type names; None if unknown."""

    notes: tuple[str, ...] = ()
    """Remarks about the bridge, in sentences."""

    layers: Mapping[str, Layers] = field(default_factory=dict)
    """The layers drawn and left out of each robot, by its namespace."""


def _resolved(topic: str) -> str:
    """Return a topic as a fleet file has it; empty if there is none."""
    return normalise_topic(topic) if topic else ""


def _camera(guess: Guess) -> CameraConfig:
    # The type is stated where the name does not show that it is video.
    camera = CameraConfig(topic=guess.topic)
    if camera.is_video or not is_type(guess.type, *VIDEO):
        return camera
    return CameraConfig(topic=guess.topic, type=guess.type)


def unique_names(
    found: Sequence[tuple[str, Findings]],
) -> list[Findings]:
    """Return the findings, with a bridge's name added to names that are not unique.

    Args:
        found: The name and the findings of each bridge.

    """
    often = Counter(
        same_name(robot.name) for _, findings in found for robot in findings.robots
    )
    taken: set[str] = set()
    result = []
    for bridge, findings in found:
        robots = []
        for robot in findings.robots:
            name = robot.name
            if often[same_name(name)] > 1:
                name = f"{name} ({bridge})"
            robots.append(replace(robot, name=free_name(name, taken)))
        result.append(replace(findings, robots=tuple(robots)))
    return result


def free_name(wanted: str, taken: set[str]) -> str:
    """Return a name that is not taken, and add it to the taken ones.

    Args:
        wanted: The name; a number is appended if it is taken.
        taken: The taken names, as :func:`same_name` returns them.

    """
    name, number = wanted, 1
    while same_name(name) in taken:
        number += 1
        name = f"{wanted} {number}"
    taken.add(same_name(name))
    return name
