"""What this client publishes, and what it never does."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from webmap.errors import BridgeError, MotionRefused
from webmap.identifiers import generate_id
from webmap.ros import ops
from webmap.ros.names import is_type, normalise_topic, same_type, split_type

_VELOCITY = ("geometry_msgs/Twist", "geometry_msgs/TwistStamped")
_GOALS = "/_action/send_goal"


class _Advertised(NamedTuple):
    id: str
    type: str


class Publications:
    """The topics that one link has advertised; decisions and frames, no I/O.

    Velocity, goals and cancel are refused: they are written by the gate alone.
    """

    def __init__(self) -> None:
        self._advertised: dict[str, _Advertised] = {}
        self._protected: set[str] = set()

    def protect(self, topic: str) -> list[bytes]:
        """Refuse ``topic`` from now on; return what to send if it was advertised."""
        name = normalise_topic(topic)
        self._protected.add(name)
        return self.forget(name)

    def frames(
        self,
        topic: str,
        message: Mapping[str, Any],
        type: str | None,
        known: str | None,
    ) -> list[bytes]:
        """Return what to send for one message: two frames if it is the first.

        Args:
            topic: The topic, absolute or from the root.
            message: The fields of the message.
            type: Its type; may be left out once it is known.
            known: What the bridge said that the topic's type is.

        Raises:
            MotionRefused: If it would move a robot.
            BridgeError: If nobody said the type, or two were said.
            ValueError: If a number is NaN or infinite.
            TypeError: If a value is nothing that JSON knows.

        """
        name = normalise_topic(topic)
        before = self._advertised.get(name)
        wanted = type or (before.type if before else known)
        self._refuse_motion(name, wanted, known)
        if wanted is None:
            raise BridgeError(f"{name}: say the message type the first time")
        if before is not None and not same_type(before.type, wanted):
            raise BridgeError(f"{name} is advertised as {before.type}, not as {wanted}")
        text = ops.publish(name, message)
        if before is not None:
            return [text]
        now = _Advertised(generate_id(), str(split_type(wanted)))
        self._advertised[name] = now
        return [ops.advertise(name, now.type, id=now.id), text]

    def again(self) -> list[bytes]:
        """Return what a new link is told before anything is published on it."""
        return [
            ops.advertise(topic, each.type, id=each.id)
            for topic, each in self._advertised.items()
        ]

    def forget(self, topic: str) -> list[bytes]:
        """Stop publishing on ``topic``; return what to send, if anything."""
        name = normalise_topic(topic)
        before = self._advertised.pop(name, None)
        return [] if before is None else [ops.unadvertise(name, id=before.id)]

    def refuse_goal_service(self, service: str) -> None:
        """Let a call pass unless it would send a robot somewhere.

        Raises:
            MotionRefused: If it would.

        """
        name = normalise_topic(service)
        if name.endswith(_GOALS) or name in self._protected:
            raise MotionRefused(f"{name}: goals go through the gate: use Robot.move()")

    def _refuse_motion(self, name: str, *types: str | None) -> None:
        if name in self._protected:
            raise MotionRefused(
                f"{name} moves a robot: use Robot.twist() or Robot.move(), "
                f"which go through the gate"
            )
        for type in types:
            if type is not None and is_type(type, *_VELOCITY):
                raise MotionRefused(
                    f"{name}: {type} is a velocity: use Robot.twist(), "
                    f"which goes through the gate"
                )
