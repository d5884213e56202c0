"""What discovery says: robots, their topics, and why it thinks so."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from webmap.discovery.tf_robots import MAP, WORLD

if TYPE_CHECKING:
    from webmap.discovery.layers import FoundLayer

Role: TypeAlias = Literal[
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
"""What a topic is to a robot."""

ROLES: tuple[Role, ...] = (
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
)
"""Every role, in the order in which they are shown."""


ACTIONS = {
    "/_action/feedback": "nav2_msgs/action/NavigateToPose",
    "/goal": "move_base_msgs/MoveBaseAction",
}
"""The topics by which actions are known, without the action's name, and their types."""


@dataclass(frozen=True, slots=True)
class Guess:
    """One topic that fits a role, and the rule that says so."""

    topic: str
    type: str
    """The type as the bridge spells it."""

    rule: str
    """The rule, in words."""


@dataclass(frozen=True, slots=True)
class FoundRobot:
    """A robot and its topics."""

    name: str
    namespace: str
    """Where its topics are: ``/robot_0``; empty for a robot without a prefix."""

    guesses: Mapping[Role, tuple[Guess, ...]] = field(default_factory=dict)
    """What fits each role, the best first."""

    notes: tuple[str, ...] = ()
    """What a person should know about these guesses, in sentences."""

    base_frame: str = ""
    """The frame of its base, as it was heard; empty if it was not."""

    root_frame: str = ""
    """The frame that its base can be drawn in: a map, or where odometry begins."""

    above: tuple[str, ...] = ()
    """The frames that its base hangs from, the nearest first."""

    def first(self, role: Role) -> Guess | None:
        """Return the best guess for a role, None if nothing fits."""
        found = self.guesses.get(role, ())
        return found[0] if found else None

    def topic(self, role: Role) -> str:
        """Return the best topic for a role, empty if nothing fits."""
        found = self.first(role)
        return "" if found is None else found.topic

    def type_of(self, role: Role) -> str:
        """Return the type of the best topic for a role, empty if it is not known."""
        found = self.first(role)
        return "" if found is None else found.type

    @property
    def action(self) -> tuple[str, str] | None:
        """The name and the type of the action that goals go to, if there is one."""
        found = self.first("action")
        if found is None:
            return None
        for tail, type in ACTIONS.items():
            if found.topic.endswith(tail):
                return found.topic.removesuffix(tail), type
        return None

    @property
    def tf_namespace(self) -> str | None:
        """The namespace of the topics with its frames; None if there are none."""
        return self.topic("tf").removesuffix("/tf") if self.topic("tf") else None

    @property
    def tf_alone(self) -> bool:
        """Whether nothing but its frames tells where it is."""
        return self.topic("tf") != "" and not (
            self.topic("odometry") or self.topic("pose")
        )

    @property
    def tf_options(self) -> dict[str, Any]:
        """The options of ``Robot.set_tf``; of use if there are frames at all."""
        options: dict[str, Any] = {"namespace": self.tf_namespace or ""}
        # Many robots have odometry, frames and no map: that is no mistake.
        options["quiet"] = not self.tf_alone
        if self.base_frame:
            options["base_frame"] = self.base_frame
        if self.tf_alone and self.root_frame:
            options["map_frame"] = self.root_frame
        elif self.map_frame != MAP:
            options["map_frame"] = self.map_frame
        return options

    @property
    def map_frame(self) -> str:
        """The frame of the map that it moves in, as its frames have it."""
        return self.root_frame if WORLD.match(self.root_frame) else MAP


@dataclass(frozen=True, slots=True)
class Findings:
    """What is behind one bridge."""

    robots: tuple[FoundRobot, ...] = ()
    dialect: Literal["ros1", "ros2"] | None = None
    """Which ROS names its types so; None if there is no telling."""

    notes: tuple[str, ...] = ()
    """What holds for all of it, in sentences."""

    layers: "Mapping[str, tuple[FoundLayer, ...]]" = field(default_factory=dict)
    """What is drawn of each robot, by its namespace."""

    left_out: "Mapping[str, tuple[FoundLayer, ...]]" = field(default_factory=dict)
    """What could be drawn of each robot too, but for its number."""
