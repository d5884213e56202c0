"""The topic with a robot's poses, whose type is determined if it is not given."""

import asyncio
import time
import weakref
from collections.abc import Callable
from typing import Any

from webmap.base.audience import RARELY
from webmap.base.errors import ConfigError, ProtocolError
from webmap.base.geometry import FARTHEST
from webmap.base.scope import Removable, Scope, enter_scope, leave_scope
from webmap.base.tasks import spawn
from webmap.poses.placing import (
    ODOMETRY_VIEWS,
    OdometryView,
    PoseReading,
    odometry_view,
    odometry_view_by_shape,
)
from webmap.ros.bridge import Bridge
from webmap.ros.decoding import convert
from webmap.ros.names import is_agent_url
from webmap.ros.subscriptions import Subscription, SubscriptionOptions

ODOMETRY = "nav_msgs/Odometry"
"""The pose type that also has a velocity."""

_NAMES = {view: name for name, view in ODOMETRY_VIEWS.items()}

THROTTLES = ((6, 16), (13, 33), (20, 50), (1000, 100))
"""The throttle, in milliseconds, of up to so many robots without one of their own: 60
poses a second of a few robots, and 10,000 of all together."""

MOST = 200
"""The throttle of more robots, in milliseconds."""

FAR = 100
"""The throttle of a robot behind an agent, whose link may be slow, in milliseconds."""


class SharedThrottle:
    """The throttle of all robots of this process that have none of their own."""

    def __init__(self) -> None:
        self.value = THROTTLES[0][1]
        """The least time between two messages of a robot, in milliseconds."""
        self._feeds: weakref.WeakSet[OdometryFeed] = weakref.WeakSet()

    def join(self, feed: "OdometryFeed") -> None:
        """Count a feed, and change the others if there are many now."""
        self._feeds.add(feed)
        self._update()

    def leave(self, feed: "OdometryFeed") -> None:
        """Count a feed no more; does nothing if it is not counted."""
        self._feeds.discard(feed)
        self._update()

    def _update(self) -> None:
        count = len(self._feeds)
        value = next((value for most, value in THROTTLES if count <= most), MOST)
        if value != self.value:
            self.value = value
            for feed in list(self._feeds):
                feed.change_pace()


shared_throttle = SharedThrottle()
"""The throttle of this process."""


class OdometryFeed:
    """A subscription to a topic with poses.

    Args:
        bridge: The connection to the ROS system that has the topic.
        topic: The topic.
        throttle: The least time between two messages, in milliseconds; None to use
            that of :data:`THROTTLES`.
        type: The message type; if not given, the bridge is queried, and the fields of
            the first message are examined.
        listener: Called with each pose, in the model's thread.
        typed: Called with the type when it is known, possibly at once; "" for a type
            without a pose.
        complain: Called with a sentence for people when the topic cannot be used, and
            with None when it can be used again.
        report: Called with a sentence about a failure that does not last.

    Raises:
        ConfigError: If ``type`` is given and has no pose.

    """

    def __init__(
        self,
        bridge: Bridge,
        topic: str,
        throttle: int | None,
        type: str | None,
        *,
        listener: Callable[[PoseReading], None],
        typed: Callable[[str], None],
        complain: Callable[[str | None], None],
        report: Callable[[str], None],
    ) -> None:
        self.bridge = bridge
        self.topic = topic
        self.throttle = throttle
        self.type: str | None = None
        self._unwatched = RARELY
        self._shares = throttle is None and not is_agent_url(bridge.url)
        self._listener = listener
        self._typed = typed
        self._on_complaint = complain
        self._complaint: str | None = None
        self._report = report
        self._scope = Scope(
            f"poses of {topic}", self._failed, lambda _: self._complain(None)
        )
        self._subscription: Subscription | None = None
        self._type_query: Removable | None = None
        if self._shares:
            shared_throttle.join(self)
        if type is None:
            self._type_query = TypeQuery(
                bridge, topic, self._on_type, self._listen_untyped
            )
        else:
            self._subscribe(odometry_view(type))

    @property
    def _asked(self) -> SubscriptionOptions:
        throttle = FAR if self.throttle is None else self.throttle
        if self._shares:
            throttle = shared_throttle.value
        return SubscriptionOptions(throttle=throttle, unwatched=self._unwatched)

    @property
    def period(self) -> float:
        """The least time between two messages now, in seconds."""
        return self._asked.least / 1000

    def keep_on(self, needed: bool) -> None:
        """Receive all poses, or only some while nobody looks."""
        unwatched = 0 if needed else RARELY
        if unwatched != self._unwatched:
            self._unwatched = unwatched
            self.change_pace()

    def change_pace(self) -> None:
        """Ask the bridge for messages as often as now needed."""
        if self._subscription is not None:
            throttle, unwatched = self._asked.throttle, self._asked.unwatched
            self._subscription.set_pace(throttle, unwatched)

    def remove(self) -> None:
        """Unsubscribe; a second call does nothing."""
        for thing in (self._subscription, self._type_query):
            if thing is not None:
                thing.remove()
        self._subscription = self._type_query = None
        shared_throttle.leave(self)

    def _listen_untyped(self) -> None:
        """Determine the type from the first message: the bridge may not know the type.

        The bridge is still queried, since the first message may arrive only when the
        robot moves.
        """
        if self._subscription is None:
            with self._scope.active():
                self._subscription = self.bridge.subscribe(
                    self.topic,
                    self._on_first,
                    throttle=self._asked.throttle,
                    unwatched=self._unwatched,
                )

    def _on_type(self, type: str) -> None:
        """Use the type that the bridge returned."""
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
        """Subscribe with the type that is now known."""
        untyped, type_query = self._subscription, self._type_query
        self._subscribe(view)
        for thing in (untyped, type_query):
            if thing is not None:
                thing.remove()
        self._type_query = None

    def _on_first(self, message: Any) -> None:
        try:
            view = odometry_view_by_shape(message)
            first = convert(message, view)
        except ProtocolError as error:
            self._complain(
                f"topic {self.topic!r}: {error}; if the topic has one of these types, "
                "set type=..."
            )
            self._typed("")
            return
        self._use(view)
        self._on_message(first)

    def _subscribe(self, view: type[OdometryView]) -> None:
        self.type = _NAMES[view]
        self._typed(self.type)
        with self._scope.active():
            self._subscription = self.bridge.subscribe(
                self.topic,
                self._on_message,
                self.type,
                throttle=self._asked.throttle,
                decode=view,
                unwatched=self._unwatched,
            )

    def _on_message(self, message: OdometryView) -> None:
        try:
            reading = PoseReading.of(message)
        except ProtocolError as error:
            self._complain(f"topic {self.topic!r}: {error}")
            return
        if not reading.is_usable:
            self._complain(
                f"topic {self.topic!r}: a pose with NaN, infinity, a number beyond "
                f"{FARTHEST:g} or a quaternion of zeros was ignored"
            )
            return
        if self._complaint is not None:
            self._complain(None)
        before = enter_scope(None)  # the listener's resources are not this topic's
        try:
            self._listener(reading)
        finally:
            leave_scope(before)

    def _failed(self, text: str, about: object) -> None:
        """Pass on a failure of the bridge; one without a subject does not last."""
        if about is None:
            self._report(text)
        else:
            self._complain(text)

    def _complain(self, text: str | None) -> None:
        if text != self._complaint:
            self._complaint = text
            self._on_complaint(text)


SOON, LATER = 2.0, 5.0
"""Seconds between two queries: for the first few, and after them."""

FEW = 5
"""How many queries use the shorter pause."""

SHARE = 10
"""The least pause after a query in multiples of its duration, so that a slow bridge is
queried rarely."""


class TypeQuery:
    """Queries the type of a topic whenever the connection opens, until it is known.

    The node that has the topic may start after the connection opened, and so may the
    node that answers the query.

    Args:
        bridge: The bridge to query.
        topic: The topic.
        found: Called with each type returned, as the bridge spells it.
        unknown: Called each time that the bridge does not know the type, if given.

    """

    def __init__(
        self,
        bridge: Bridge,
        topic: str,
        found: Callable[[str], object],
        unknown: Callable[[], object] | None = None,
    ) -> None:
        self._bridge = bridge
        self._topic = topic
        self._found = found
        self._unknown = unknown
        self._known = False
        self._over = False
        self._turn = 0
        self._timer: asyncio.TimerHandle | None = None
        self._opening: Removable = bridge.on_open(self._begin)

    def remove(self) -> None:
        """Stop the queries; a second call does nothing."""
        self._over = True
        self._opening.remove()
        self._drop()

    def _begin(self) -> None:
        self._drop()
        if not self._over:
            spawn(self._ask(self._turn, 1))

    def _drop(self) -> None:
        """Ignore a pending answer, and cancel the next query."""
        self._turn += 1
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    async def _ask(self, turn: int, number: int) -> None:
        began = time.monotonic()
        type = await self._bridge.topic_type(self._topic)
        if turn != self._turn:
            return
        if type is not None:
            self._known = True
            self._found(type)
            return
        if self._unknown is not None:
            self._unknown()
        if not self._known:  # a type from before the connection was lost stays valid
            took = time.monotonic() - began
            pause = max(SOON if number <= FEW else LATER, SHARE * took)
            # No task waits meanwhile, so none is left when the process ends.
            loop = asyncio.get_running_loop()
            self._timer = loop.call_later(pause, self._again, turn, number + 1)

    def _again(self, turn: int, number: int) -> None:
        if turn == self._turn and self._bridge.state == "open":
            spawn(self._ask(turn, number))
