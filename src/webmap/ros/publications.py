"""What this client publishes, and what it never does."""

from collections.abc import Mapping
from typing import Any, NamedTuple
from weakref import WeakValueDictionary

from webmap.errors import BridgeError, MotionRefused
from webmap.identifiers import generate_id
from webmap.ros import ops
from webmap.ros.names import is_type, normalise_topic, same_type, split_type

_VELOCITY = ("geometry_msgs/Twist", "geometry_msgs/TwistStamped")
_GOALS = "/_action/send_goal"

STOP = "what STOP says"
"""What a topic carries that is a robot's stop hook."""

INSTEAD = {
    "a velocity": "Robot.twist()",
    "a goal": "Robot.move()",
    "the end of a goal": "Robot.cancel()",
    "an initial pose": "Robot.locate()",
    STOP: "Robot.stop() and Robot.reset_stop()",
}
"""Where that is said, by what a topic carries."""


class Written(dict[str, str]):
    """What the gate alone writes behind one address: what each topic carries."""


_written: WeakValueDictionary[str, Written] = WeakValueDictionary()


def written_behind(url: str) -> Written:
    """Return what the gate writes behind an address; the same for all its bridges."""
    return _written.setdefault(url, Written())


class _Advertised(NamedTuple):
    id: str
    type: str


class Publications:
    """The topics that one link has advertised; decisions and frames, no I/O.

    Velocity, goals, cancel and what STOP says are refused: they are written by the
    gate alone.

    Args:
        protected: What is refused from the beginning, and is added to.

    """

    def __init__(self, protected: Written) -> None:
        self._advertised: dict[str, _Advertised] = {}
        self._protected = protected

    def protect(self, topic: str, carries: str = "a goal") -> list[bytes]:
        """Refuse ``topic`` from now on; return what to send if it was advertised.

        Args:
            topic: Its name.
            carries: What it carries, in the words of :data:`INSTEAD`.

        """
        name = normalise_topic(topic)
        if self._protected.get(name, STOP) == STOP:  # a goal stays one
            self._protected[name] = carries
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
        # A topic that is a stop hook may well have a service of its name beside it.
        moves = self._protected.get(name, STOP) != STOP
        if name.endswith(_GOALS) or moves:
            raise MotionRefused(f"{name}: goals go through the gate: use Robot.move()")

    def _refuse_motion(self, name: str, *types: str | None) -> None:
        carried = self._protected.get(name)
        if carried is not None:
            instead = INSTEAD.get(carried, "Robot.twist() or Robot.move()")
            raise MotionRefused(
                f"{name} carries {carried} of a robot, which the gate alone writes: "
                f"use {instead}"
            )
        for type in types:
            if type is not None and is_type(type, *_VELOCITY):
                raise MotionRefused(
                    f"{name}: {type} is a velocity: use Robot.twist(), "
                    f"which goes through the gate"
                )
