"""The subscription to one topic of a bridge: type, encoding and pace.

rosbridge for ROS 2 splits JSON that is larger than its parameter ``max_message_size``
(10 MB by default) into fragments. CBOR of that size it does not split: it logs an error
and sends nothing. So a large map, which is published once, would never come, and is
requested in JSON.
"""

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterable
from typing import Literal, NamedTuple

from webmap.base.identifiers import generate_id
from webmap.base.scope import no_scope
from webmap.ros.names import VIDEO, is_type, split_type
from webmap.ros.rosbridge import ops
from webmap.ros.rosbridge.events import Publish
from webmap.ros.subscriptions import Topic

COMPRESSION = {"text": "none", "binary": "cbor", "raw": "cbor-raw"}
"""The names in rosbridge for the encodings of a subscription."""

BULK = (
    "sensor_msgs/LaserScan",
    "nav_msgs/OccupancyGrid",
    "sensor_msgs/PointCloud2",
    "nav_msgs/GridCells",
    "nav_msgs/Path",
    "geometry_msgs/PoseArray",
    "visualization_msgs/Marker",
    "visualization_msgs/MarkerArray",
    *VIDEO,
)
"""Types that come in CBOR unless a listener asks for another encoding.

A bridge encodes CBOR faster, and only once. JSON that it encodes for longer than the
throttle can hang it when a client leaves: see :func:`.ops.subscribe`. Types with an
array of fixed length are excluded, since bridges before 2.5 cannot send them as CBOR.
"""

REPLACED = (
    "nav_msgs/OccupancyGrid",
    "sensor_msgs/PointCloud2",
    "sensor_msgs/Image",
    "sensor_msgs/CompressedImage",
)
"""Types that may exceed 10 MB, of which each message replaces the last.

Only these are requested in JSON: it needs a long throttle, which would lose messages
that must not be lost, such as changes of a map.
"""

THROTTLE = 300_000
"""Least milliseconds between two messages that come in JSON instead of CBOR.

A bridge needs 10 s of processor time to encode 16 million cells, and answers everything
else late meanwhile. The throttle must be longer than the encoding, or the bridge can
hang when a client leaves: see :func:`.ops.subscribe`.
"""

PATIENCE = {"cbor": 20.0, "none": 120.0}
"""Seconds for which a bridge may be busy with the first message, by its encoding."""

MOST_LOST = 2
"""Connections that may end while JSON is awaited; then it is no longer requested."""

Answer = Literal["ask", "given up"]


class InJson:
    """Decides whether a topic is requested in JSON instead of CBOR."""

    def __init__(self) -> None:
        self._state: Literal["cbor", "asked", "json", "not again"] = "cbor"
        self._lost = 0

    @property
    def on(self) -> bool:
        """Whether to request JSON now."""
        return self._state in ("asked", "json")

    def silent(self, type: str | None, compression: str | None) -> Answer | None:
        """Handle a published topic that sends nothing; return what to do, if anything.

        Args:
            type: The type of the topic.
            compression: The encoding of the request.

        """
        if compression != "cbor" or type is None or not is_type(type, *REPLACED):
            return None
        if self._state != "cbor":
            return None
        if self._lost >= MOST_LOST:
            self._state = "not again"
            return "given up"
        self._state = "asked"
        return "ask"

    def received(self, *, in_parts: bool) -> bool | None:
        """Handle a message; return whether it was too large for CBOR.

        None if that is already known, or CBOR was not in question. A message that came
        in one part was not too large but published late, so CBOR is requested again,
        and JSON no more on this connection.
        """
        if self._state != "asked":
            return None
        self._lost = 0
        self._state = "json" if in_parts else "not again"
        return in_parts

    def begin(self) -> None:
        """Start again with CBOR: the new connection may lead to a changed bridge."""
        if self._state == "asked":
            self._lost += 1
        self._state = "cbor"


class WireSubscription:
    """The subscription of one connection to one topic, for all its listeners.

    Args:
        topic: The topic and its listeners.
        send: Sends a frame if the connection is open.
        too_large: Called when messages prove too large for CBOR, with the bytes of one
            in JSON; with None if connections ended before one came.

    """

    def __init__(
        self,
        topic: Topic,
        *,
        send: Callable[[bytes], None],
        too_large: Callable[[Topic, int | None], None],
    ) -> None:
        self.topic = topic
        self.checks_json = False
        """Whether JSON was requested; :meth:`received` checks if that was needed."""
        self._send = send
        self._too_large = too_large
        self._in_json = InJson()
        self._asked: _Asked | None = None
        self._asked_at = 0.0
        """When the first message of this encoding was requested."""
        self._id = ""

    def update(self) -> None:
        """Subscribe again if the needed options have changed.

        The new subscription begins before the old one ends, so no message is missed.
        """
        options = self._wire_options()
        if self._asked == options:
            return
        old, had = self._id, self._asked is not None
        self._ask(options)
        if had:
            self._send(ops.unsubscribe(self.topic.name, id=old))

    def again(self) -> None:
        """Subscribe on a new connection."""
        self.checks_json = False
        self._in_json.begin()
        self._ask(self._wire_options())

    def renew(self) -> None:
        """End the subscription and subscribe again.

        A bridge keeps the quality of service of the old subscription while one exists.
        """
        if self._asked is not None:
            self._send(ops.unsubscribe(self.topic.name, id=self._id))
            self._ask(self._wire_options())

    def end(self) -> None:
        """Unsubscribe at the bridge, if this was subscribed there."""
        if self._asked is not None:
            self._send(ops.unsubscribe(self.topic.name, id=self._id))
        self._asked = None

    def link_lost(self) -> None:
        """Forget the subscription of the connection that has ended."""
        self._asked = None

    def ask_in_json(self) -> bool:
        """Subscribe in JSON because no CBOR comes; return whether that was done."""
        if self._asked is None:
            return False
        answer = self._in_json.silent(self._asked.type, self._asked.compression)
        if answer == "ask":
            self.checks_json = True
            self.renew()
        elif answer == "given up":
            self._too_large(self.topic, None)
        return answer == "ask"

    def received(self, message: Publish) -> None:
        """Handle the first message that came in JSON instead of CBOR."""
        self.checks_json = False
        too_large = self._in_json.received(in_parts=message.in_parts)
        if too_large:
            self._too_large(self.topic, len(message.frame))
        elif too_large is False:
            self.renew()

    @property
    def awaits_large(self) -> bool:
        """Whether the bridge may be busy with a large message for this topic."""
        asked = self._asked
        if self.topic.count or asked is None or asked.type is None:
            return False
        if not is_type(asked.type, *REPLACED):
            return False
        waited = time.monotonic() - self._asked_at
        return waited < PATIENCE.get(asked.compression or "", 0.0)

    def _wire_options(self) -> "_Asked":
        """Return options that serve every listener."""
        options = self.topic.options()
        type, throttle = options.type, options.throttle
        compression = COMPRESSION.get(options.encoding or "")
        if compression is None and type is not None and is_type(type, *BULK):
            compression = "cbor"
        if compression == "cbor" and self._in_json.on:
            throttle, compression = max(throttle, THROTTLE), "none"
        # The name of ROS 1, which bridges of both kinds accept.
        name = str(split_type(type)) if type else None
        return _Asked(name, throttle, options.queue_length, compression)

    def _ask(self, asked: "_Asked") -> None:
        if self._asked is None or self._asked.compression != asked.compression:
            self._asked_at = time.monotonic()
        self._asked, self._id = asked, generate_id()
        self._send(ops.subscribe(self.topic.name, id=self._id, **asked._asdict()))


class _Asked(NamedTuple):
    type: str | None
    throttle_rate: int
    queue_length: int
    compression: str | None


FIRST = 2.0
"""Seconds without messages after which a topic is checked."""

LONGEST = 8.0
"""The longest time between two checks, in seconds."""

AGAIN = 30.0
"""Seconds after which a published topic without messages is subscribed to again."""

IN_CBOR = 10.0
"""Seconds without messages after which a published topic is requested in JSON."""

UNANSWERED = 3
"""Unanswered questions in a row after which none is asked on a connection.

A call that hangs can delay every later one.
"""

PERIOD = 1.0
"""Seconds between two rounds."""


class TopicSilence:
    """When to check one topic without messages, and when to subscribe again. No I/O.

    Args:
        now: Seconds, monotonic.

    """

    def __init__(self, now: float) -> None:
        self._wait = FIRST
        self._next = now + FIRST
        self._published: bool | None = None
        self._renewed = now
        self._began = now
        self._unsent_at: float | None = None
        """When it will have been published without messages for :data:`IN_CBOR`."""

    def due(self, now: float) -> bool:
        """Return whether to ask for its publishers now."""
        return now >= self._next

    def is_unsent(self, now: float) -> bool:
        """Return whether it was published without messages for :data:`IN_CBOR`."""
        return self._unsent_at is not None and now >= self._unsent_at

    def answered(self, published: bool | None, now: float) -> bool:
        """Handle the answer about publishers; return whether to subscribe again.

        Args:
            published: Whether the topic has a publisher; None if unknown.
            now: Seconds, monotonic.

        """
        before, self._published = self._published, published
        self._wait = min(2 * self._wait, LONGEST)
        self._next = now + self._wait
        came = published is True and before is not True
        if published is not True:
            self._unsent_at = None
        elif self._unsent_at is None:
            since = self._began if before is None else now
            self._unsent_at = since + IN_CBOR
        if self._unsent_at is not None and now < self._unsent_at < self._next:
            self._next = self._unsent_at
        renew = published is not False and (came or now - self._renewed >= AGAIN)
        if renew:
            self._renewed = now
        return renew


class Renewals:
    """Checks the topics of one bridge without messages, and subscribes again.

    A bridge of ROS 2 chooses its quality of service by the publishers that a topic has
    at that moment. A map that is published later and once, or a topic whose type was
    not stated, would never come. A message above ``max_message_size`` does not come in
    CBOR at all: after some time it is requested in JSON.

    Args:
        published: Asks the bridge whether a topic has a publisher.
        subscriptions: Returns the current subscriptions.

    """

    def __init__(
        self,
        published: Callable[[str], Awaitable[bool | None]],
        subscriptions: Callable[[], Iterable[WireSubscription]],
    ) -> None:
        self._published = published
        self._subscriptions = subscriptions
        self._task: asyncio.Task[None] | None = None
        self._unanswered = 0

    def begin(self) -> None:
        """Start again for a new connection."""
        self.forget()
        self._unanswered = 0
        with no_scope():
            self._task = asyncio.get_running_loop().create_task(self._check_regularly())

    def forget(self) -> None:
        """Stop the checks: the connection has ended."""
        if self._task is not None:
            self._task.cancel()
            self._task = None

    async def stop(self) -> None:
        """Stop the checks, and wait until they have stopped."""
        task = self._task
        self.forget()
        if task is not None:
            await asyncio.gather(task, return_exceptions=True)

    async def _check_regularly(self) -> None:
        silent: dict[WireSubscription, TopicSilence] = {}
        while True:
            await asyncio.sleep(PERIOD)
            now = time.monotonic()
            without = [each for each in self._subscriptions() if not each.topic.count]
            silent = {each: silent.get(each) or TopicSilence(now) for each in without}
            for subscription, silence in silent.items():
                if silence.due(now):
                    await self._check(subscription, silence)

    async def _check(
        self, subscription: WireSubscription, silence: TopicSilence
    ) -> None:
        topic, published = subscription.topic, None
        if self._unanswered < UNANSWERED:
            published = await self._published(topic.name)
            self._unanswered = self._unanswered + 1 if published is None else 0
        now = time.monotonic()
        renew = silence.answered(published, now)
        if topic.count or not topic.listeners:
            return
        if silence.is_unsent(now) and subscription.ask_in_json():
            return
        if renew:
            subscription.renew()
