"""Where the velocity of a robot goes, as its road to the gate keeps it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from webmap.errors import ConfigError
from webmap.gate.limits import Axes
from webmap.ros.bridge import Bridge
from webmap.ros.names import normalise_topic, same_type
from webmap.ros.publications import STOP

TWIST_TYPES = ("geometry_msgs/Twist", "geometry_msgs/TwistStamped")


@dataclass(frozen=True, slots=True)
class TwistTopic:
    """Where velocity goes, and what is known of the base behind it."""

    bridge: Bridge
    topic: str
    type: str | None
    stops_within: float | None
    v_max: float | None
    w_max: float | None
    a_max: float | None
    holonomic: bool
    stop_hooks: Sequence[Mapping[str, str]] = ()
    z_max: float | None = None
    rx_max: float | None = None
    ry_max: float | None = None

    @property
    def axes(self) -> Axes:
        """The axes out of the plane that the base moves along, and how fast at most."""
        return Axes(self.z_max or 0.0, self.rx_max or 0.0, self.ry_max or 0.0)

    def writes(self) -> dict[str, str]:
        """Return what the gate alone writes: topics, and what each carries."""
        hooks = [hook["topic"] for hook in self.stop_hooks if "topic" in hook]
        said = {normalise_topic(topic): STOP for topic in hooks}
        return {**said, normalise_topic(self.topic): "a velocity"}


def check_twist_type(topic: str, type_name: str) -> None:
    """Let the type of a topic pass if it carries a velocity.

    Raises:
        ConfigError: If it does not.

    """
    if not any(same_type(known, type_name) for known in TWIST_TYPES):
        raise ConfigError(
            f"topic {topic!r} has type {type_name}; velocity goes to "
            f"{TWIST_TYPES[0]} or {TWIST_TYPES[1]}"
        )
