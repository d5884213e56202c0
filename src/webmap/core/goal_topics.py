"""Where goals and the initial pose of a robot go, as its road to the gate keeps it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from webmap.errors import ConfigError
from webmap.gate.specs import ACTIONS
from webmap.ros.names import is_type, normalise_topic

if TYPE_CHECKING:
    from webmap.ros.bridge import Bridge

NAVIGATE_TO_POSE = "nav2_msgs/action/NavigateToPose"
MOVE_BASE = "move_base_msgs/MoveBaseAction"

ON_LOSS = ("continue", "cancel")
"""What becomes of a goal when its operator is lost."""

COVARIANCE = (0.25, 0.25, 0.068)
"""How sure RViz has a person be: half a metre each way, and 15 degrees."""


@dataclass(frozen=True, slots=True)
class MoveTopic:
    """Where goals go, and how one is called off."""

    bridge: "Bridge"
    topic: str
    """Empty if there is an action alone."""
    frame: str
    cancel_topic: str | None
    on_operator_loss: str
    action: str | None = None
    action_type: str = NAVIGATE_TO_POSE

    def __post_init__(self) -> None:
        if not self.topic and not self.action:
            raise ConfigError("goals go to a topic or to an action: neither is given")
        # Were a typing error taken for one of the two, a goal might go on unwatched.
        if self.on_operator_loss not in ON_LOSS:
            raise ConfigError(
                f"on_operator_loss is {' or '.join(map(repr, ON_LOSS))}, "
                f"got {self.on_operator_loss!r}"
            )
        if not is_type(self.action_type, *ACTIONS):
            raise ConfigError(
                f"the type of an action that takes goals is {' or '.join(ACTIONS)}, "
                f"got {self.action_type!r}"
            )

    def writes(self) -> dict[str, str]:
        """Return what the gate alone writes: topics, and what each carries."""
        action = self.action
        names = (
            (self.topic, "a goal"),
            (self.cancel_topic, "the end of a goal"),
            (action and f"{action}/goal", "a goal"),
            (action and f"{action}/cancel", "the end of a goal"),
        )
        return {normalise_topic(name): carried for name, carried in names if name}

    def protect(self) -> None:
        """Have the bridge refuse to publish where the gate writes."""
        for name, carried in self.writes().items():
            self.bridge.protect(name, carried)

    def spelled(self, name: str) -> str:
        """Return a type of ``geometry_msgs`` as the dialect of the action has it."""
        ros2 = self.action and "/action/" in self.action_type
        return f"geometry_msgs/msg/{name}" if ros2 else f"geometry_msgs/{name}"

    def fields(self) -> dict[str, Any]:
        """Return what the gate must know of it."""
        return {
            "goal_url": self.bridge.url,
            "goal_topic": self.topic or None,
            "goal_frame": self.frame,
            "cancel_topic": self.cancel_topic,
            "action": self.action,
            "action_type": self.action_type,
            "goal_type": self.spelled("PoseStamped"),
            "on_operator_loss": self.on_operator_loss,
        }


@dataclass(frozen=True, slots=True)
class InitialPoseTopic:
    """Where a robot is told where it is, and how sure one is of that."""

    bridge: "Bridge"
    topic: str
    covariance: tuple[float, float, float]
    frame: str = "map"

    @classmethod
    def of(
        cls, bridge: "Bridge", topic: str, covariance: Sequence[float], frame: str
    ) -> "InitialPoseTopic":
        """Return what was said, once it makes sense.

        Raises:
            ConfigError: If the covariance is not three numbers from 0 on.

        """
        numbers = tuple(covariance)
        if len(numbers) != 3 or not all(
            isinstance(n, int | float) and 0 <= n < float("inf") for n in numbers
        ):
            raise ConfigError(
                "the covariance of an initial pose is three numbers from 0 on, of x "
                f"and y in m² and of yaw in rad²; got {covariance!r}"
            )
        return cls(bridge, topic, (numbers[0], numbers[1], numbers[2]), frame)

    def writes(self) -> dict[str, str]:
        """Return what the gate alone writes: the topic, and what it carries."""
        return {normalise_topic(self.topic): "an initial pose"}

    def fields(self, goals: MoveTopic | None) -> dict[str, Any]:
        """Return what the gate must know of it.

        Raises:
            ConfigError: If the robot's goals go to another bridge.

        """
        if goals is not None and goals.bridge.url != self.bridge.url:
            raise ConfigError(
                f"goals go to {goals.bridge.url} and the initial pose to "
                f"{self.bridge.url}: both go to one bridge"
            )
        name = "PoseWithCovarianceStamped"
        plain = f"geometry_msgs/{name}"
        return {
            "goal_url": self.bridge.url,
            "goal_frame": self.frame if goals is None else goals.frame,
            "pose_type": plain if goals is None else goals.spelled(name),
            "pose_topic": self.topic,
            "pose_covariance": self.covariance,
        }
