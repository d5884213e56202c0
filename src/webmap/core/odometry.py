"""How a robot hears where it is: one topic, its type found out when not said."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from webmap.core.tasks import spawn
from webmap.core.type_asking import TypeAsking
from webmap.errors import ConfigError, ProtocolError
from webmap.geometry import Quaternion, Twist, Vector3
from webmap.geometry.reach import FARTHEST
from webmap.ros.bridge import Bridge
from webmap.ros.decoding import convert
from webmap.ros.messages import OdometryMsg
from webmap.ros.views import (
    ODOMETRY_VIEWS,
    OdometryView,
    odometry_view,
    odometry_view_by_shape,
)
from webmap.scope import Removable, Scope, no_scope

_NAMES = {view: name for name, view in ODOMETRY_VIEWS.items()}


@dataclass(frozen=True, slots=True)
class PoseReading:
    """What one message says of a robot's pose, and of its motion if it does."""

    position: Vector3
    orientation: Quaternion
    twist: Twist | None = None
    frame_id: str = ""
    """The frame of the pose; empty if the message does not say."""

    stamp: float = 0.0
    """When it was measured, in seconds of the robot's clock; 0 if not said."""

    @classmethod
    def of(cls, message: OdometryView) -> "PoseReading":
        """Take the pose out of a decoded message."""
        place = message.place
        return cls(
            place.position.vector,
            place.orientation.quaternion,
            message.velocity if isinstance(message, OdometryMsg) else None,
            message.frame_id,
            message.stamp,
        )

    @property
    def is_usable(self) -> bool:
        """Whether it is somewhere that can be drawn, and the orientation is one."""
        p, q = self.position, self.orientation
        numbers = (p.x, p.y, p.z, q.x, q.y, q.z, q.w)
        return all(abs(number) < FARTHEST for number in numbers) and q.norm > 1e-6


class PoseListener(Protocol):
    """Who is told the poses."""

    def __call__(self, reading: PoseReading) -> None:
        """Take the newest pose."""


class OdometryFeed:
    """A subscription to a topic with poses.

    Args:
        bridge: The link to the ROS system that has the topic.
        topic: The topic.
        throttle: The least time between two messages, in milliseconds.
        type: The message type; asked of rosapi, or told from the first message's
            shape, if not given.
        listener: Called with each pose, in the model's thread.
        complain: Called with a sentence for people when the topic cannot be used,
            and with None when it can be used again.
        typed: Called with the type when it is known, which may be at once; "" is one
            that tells no pose.
        scope: Is told of messages that cannot be decoded.

    Raises:
        ConfigError: If ``type`` is given and has no pose in it.

    """

    def __init__(
        self,
        bridge: Bridge,
        topic: str,
        throttle: int,
        type: str | None,
        listener: PoseListener,
        complain: Callable[[str | None], None],
        typed: Callable[[str], None],
        scope: Scope,
    ) -> None:
        self.bridge = bridge
        self.topic = topic
        self.throttle = throttle
        self.type: str | None = None
        self._listener = listener
        self._complain = complain
        self._typed = typed
        self._scope = scope
        self._opening: Removable | None = None
        self._subscription: Removable | None = None
        self._asking: Removable | None = None
        if type is None:
            self._opening = bridge.on_open(self._on_open)
            return
        self._subscribe(odometry_view(type))

    def remove(self) -> None:
        """Unsubscribe; the second call does nothing."""
        for thing in (self._opening, self._subscription, self._asking):
            if thing is not None:
                thing.remove()
        self._opening = self._subscription = self._asking = None

    def _on_open(self) -> None:
        if self._subscription is None:
            spawn(self._find_out())

    async def _find_out(self) -> None:
        found = await self.bridge.topic_type(self.topic)
        if self._subscription is not None or self._opening is None:
            return
        if found is None:
            with self._scope.active():
                self._subscription = self.bridge.subscribe(
                    self.topic, self._on_first, throttle=self.throttle
                )
            # Who has the topic may start later, and may say nothing before it moves.
            self._asking = TypeAsking(self.bridge, self.topic, self._told)
            return
        self._told(found)

    def _told(self, type: str) -> None:
        """Take the type that rosapi tells."""
        if self.type is not None:
            return
        try:
            view = odometry_view(type)
        except ConfigError as error:
            self._complain(f"topic {self.topic!r}: {error}")
            self._typed("")
        else:
            self._use(view)

    def _use(self, view: type[OdometryView]) -> None:
        """Listen with the type that is known now."""
        untyped, asking = self._subscription, self._asking
        self._subscribe(view)
        for thing in (untyped, asking):
            if thing is not None:
                thing.remove()
        self._asking = None

    def _on_first(self, message: Any) -> None:
        try:
            view = odometry_view_by_shape(message)
            first = convert(message, view)
        except ProtocolError as error:
            self._complain(f"topic {self.topic!r}: {error}; say type=... if one does")
            self._typed("")
            return
        self._use(view)
        self._hear(first)

    def _subscribe(self, view: type[OdometryView]) -> None:
        self.type = next(
            name for name, known in ODOMETRY_VIEWS.items() if known is view
        )
        self._typed(self.type)
        with self._scope.active():
            self._subscription = self.bridge.subscribe(
                self.topic, self._hear, self.type, throttle=self.throttle, decode=view
            )

    def _hear(self, message: OdometryView) -> None:
        try:
            reading = PoseReading.of(message)
        except ProtocolError as error:
            self._complain(f"topic {self.topic!r}: {error}")
            return
        if reading.is_usable:
            self._complain(None)
            with no_scope():  # what others make of it is not this topic's
                self._listener(reading)
        else:
            self._complain(
                f"topic {self.topic!r}: a pose with NaN, infinity, a number beyond "
                f"{FARTHEST:g} or a quaternion of zeros was ignored"
            )
