"""What a link asks of its bridge for one topic: its type, its encoding and its pace.

rosbridge for ROS 2 splits what is larger than its parameter ``max_message_size`` (10 MB
unless somebody sets it) into fragments. It does so for JSON; for CBOR it fails, logs an
error and sends nothing. So a large map, which is published once, would never come, and
is asked for in JSON.
"""

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterable
from typing import Literal, NamedTuple

from webmap.base.identifiers import generate_id
from webmap.base.scope import no_scope
from webmap.ros.names import is_type, split_type
from webmap.ros.rosbridge import ops
from webmap.ros.rosbridge.events import Publish
from webmap.ros.subscriptions import Topic

COMPRESSION = {"text": "none", "binary": "cbor", "raw": "cbor-raw"}
"""What rosbridge calls the encodings of a subscription."""

BULK = (
    "sensor_msgs/LaserScan",
    "nav_msgs/OccupancyGrid",
    "sensor_msgs/PointCloud2",
    "nav_msgs/GridCells",
    "nav_msgs/Path",
    "geometry_msgs/PoseArray",
    "visualization_msgs/Marker",
    "visualization_msgs/MarkerArray",
)
"""Types that come in CBOR unless a listener asks for something else.

A bridge encodes CBOR faster, and only once. JSON that it encodes for longer than the
throttle can hang it when a client leaves: see :func:`.ops.subscribe`.
No type with an array of fixed length is here, since bridges cannot send that as CBOR.
"""

REPLACED = (
    "nav_msgs/OccupancyGrid",
    "sensor_msgs/PointCloud2",
    "sensor_msgs/Image",
    "sensor_msgs/CompressedImage",
)
"""Types above 10 MB at times, of which each message takes the place of the last.

No others are asked for in JSON: with the throttle that this takes, messages would be
lost that count, such as changes of a map.
"""

THROTTLE = 300_000
"""Least milliseconds between two messages that come in JSON in place of CBOR.

A bridge needs 10 s of processor time to encode 16 million cells, and answers everything
else late meanwhile. The throttle has to be longer than that takes, or the bridge can
hang when a client leaves: see :func:`.ops.subscribe`.
"""

PATIENCE = {"cbor": 20.0, "none": 120.0}
"""Seconds for which a bridge may be busy with the first message, by its encoding."""

MOST_LOST = 2
"""Links that may end while a message in JSON is awaited, until none is asked for."""

Answer = Literal["ask", "given up"]


class InJson:
    """Decides whether a topic is asked for in JSON in place of CBOR."""

    def __init__(self) -> None:
        self._state: Literal["cbor", "asked", "json", "not again"] = "cbor"
        self._lost = 0

    @property
    def on(self) -> bool:
        """Whether JSON is to be asked for now."""
        return self._state in ("asked", "json")

    def silent(self, type: str | None, compression: str | None) -> Answer | None:
        """Take in that a published topic stays silent; return what to do, if anything.

        Args:
            type: The type of the topic.
            compression: As what it was asked for.

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
        """Take in a message; return whether it was too large for CBOR.

        None if that is known already, or CBOR was not doubted. A message that came in
        one part was not too large but published late, so CBOR is asked for again, and
        JSON no more on this link.
        """
        if self._state != "asked":
            return None
        self._lost = 0
        self._state = "json" if in_parts else "not again"
        return in_parts

    def begin(self) -> None:
        """Begin anew with CBOR: there is a new link, maybe to a bridge set anew."""
        if self._state == "asked":
            self._lost += 1
        self._state = "cbor"


class WireSubscription:
    """What a link asked of its bridge for one topic, on behalf of all its listeners.

    Args:
        topic: The topic and its listeners.
        send: Sends a frame if the link is open, else does nothing.
        too_large: Called when messages turn out to be too large for CBOR, with the
            bytes of one in JSON; with None if links ended before one came.

    """

    def __init__(
        self,
        topic: Topic,
        *,
        send: Callable[[bytes], None],
        too_large: Callable[[Topic, int | None], None],
    ) -> None:
        self.topic = topic
        self.doubts_cbor = False
        """Whether JSON was asked for, and :meth:`received` shows if that was needed."""
        self._send = send
        self._too_large = too_large
        self._in_json = InJson()
        self._asked: _Asked | None = None
        self._asked_at = 0.0
        """When the bridge was asked for the first message of this encoding."""
        self._id = ""

    def update(self) -> None:
        """Ask the bridge anew if what is wanted has changed.

        The new subscription begins before the old one ends, so nothing is missed.
        """
        wanted = self._wanted()
        if self._asked == wanted:
            return
        old, had = self._id, self._asked is not None
        self._ask(wanted)
        if had:
            self._send(ops.unsubscribe(self.topic.name, id=old))

    def again(self) -> None:
        """Ask the bridge on a new link, which knows nothing of the old one."""
        self.doubts_cbor = False
        self._in_json.begin()
        self._ask(self._wanted())

    def renew(self) -> None:
        """Give the subscription up and ask for it anew.

        While there is one, a bridge goes on with the old one's quality of service.
        """
        if self._asked is not None:
            self._send(ops.unsubscribe(self.topic.name, id=self._id))
            self._ask(self._wanted())

    def end(self) -> None:
        """Ask for no more messages."""
        if self._asked is not None:
            self._send(ops.unsubscribe(self.topic.name, id=self._id))
        self._asked = None

    def link_lost(self) -> None:
        """Forget what was asked on the link that has ended."""
        self._asked = None

    def ask_in_json(self) -> bool:
        """Ask for JSON because CBOR does not come; return whether that was done."""
        if self._asked is None:
            return False
        answer = self._in_json.silent(self._asked.type, self._asked.compression)
        if answer == "ask":
            self.doubts_cbor = True
            self.renew()
        elif answer == "given up":
            self._too_large(self.topic, None)
        return answer == "ask"

    def received(self, message: Publish) -> None:
        """Take in the first message that came in JSON in place of CBOR."""
        self.doubts_cbor = False
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

    def _wanted(self) -> "_Asked":
        """Return what serves every listener."""
        options = self.topic.options()
        type, throttle = options.type, options.throttle
        compression = COMPRESSION.get(options.encoding or "")
        if compression is None and type is not None and is_type(type, *BULK):
            compression = "cbor"
        if compression == "cbor" and self._in_json.on:
            throttle, compression = max(throttle, THROTTLE), "none"
        # The name as in ROS 1, which bridges of both kinds understand.
        name = str(split_type(type)) if type else None
        return _Asked(name, throttle, options.queue_length, compression)

    def _ask(self, asked: "_Asked") -> None:
        if self._asked is None or self._asked.compression != asked.compression:
            self._asked_at = time.monotonic()
        self._asked, self._id = asked, generate_id()
        self._send(
            ops.subscribe(
                self.topic.name,
                id=self._id,
                type=asked.type,
                throttle_rate=asked.throttle,
                queue_length=asked.queue_length,
                compression=asked.compression,
            )
        )


class _Asked(NamedTuple):
    type: str | None
    throttle: int
    queue_length: int
    compression: str | None


FIRST = 2.0
"""Seconds of silence after which a topic is looked after."""

LONGEST = 8.0
"""The longest time between two looks, in seconds."""

AGAIN = 30.0
"""Seconds after which a topic that is published and stays silent is asked for anew."""

IN_CBOR = 10.0
"""Seconds of silence after which a published topic is asked for in JSON, not CBOR."""

UNANSWERED = 3
"""Questions in a row that go unanswered until no more are asked on a link.

A call that hangs can hold up every later one.
"""

PERIOD = 1.0
"""Seconds between two rounds."""


class Silence:
    """When to look after one silent topic, and when to subscribe to it again. No I/O.

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
        """When it will have been published and silent for :data:`IN_CBOR`."""

    def due(self, now: float) -> bool:
        """Return whether it is time to ask who publishes it."""
        return now >= self._next

    def is_unsent(self, now: float) -> bool:
        """Return whether it has been published and silent for :data:`IN_CBOR`."""
        return self._unsent_at is not None and now >= self._unsent_at

    def heard(self, published: bool | None, now: float) -> bool:
        """Take in whether anybody publishes it; return whether to subscribe again.

        Args:
            published: None if the bridge cannot tell.
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
    """Looks after the silent topics of one bridge, and subscribes to them again.

    A bridge of ROS 2 chooses how it subscribes by those who publish a topic at that
    moment. A map that is published later and once, or a topic whose type was not
    stated, would never come; nor would either come by itself.
    A message above ``max_message_size`` does not come in CBOR at all: after some time
    it is asked for in JSON.

    Args:
        published: Asks the bridge whether anybody publishes a topic.
        subscriptions: What is subscribed to now.

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
        """Begin anew: there is a new link."""
        self.forget()
        self._unanswered = 0
        with no_scope():
            self._task = asyncio.get_running_loop().create_task(self._look_on())

    def forget(self) -> None:
        """Look no more: the link has ended."""
        if self._task is not None:
            self._task.cancel()
            self._task = None

    async def stop(self) -> None:
        """Look no more, and wait until that is so."""
        task = self._task
        self.forget()
        if task is not None:
            await asyncio.gather(task, return_exceptions=True)

    async def _look_on(self) -> None:
        silent: dict[WireSubscription, Silence] = {}
        while True:
            await asyncio.sleep(PERIOD)
            now = time.monotonic()
            wanted = [each for each in self._subscriptions() if not each.topic.count]
            silent = {each: silent.get(each) or Silence(now) for each in wanted}
            for subscription, silence in silent.items():
                if silence.due(now):
                    await self._look(subscription, silence)

    async def _look(self, subscription: WireSubscription, silence: Silence) -> None:
        topic, published = subscription.topic, None
        if self._unanswered < UNANSWERED:
            published = await self._published(topic.name)
            self._unanswered = self._unanswered + 1 if published is None else 0
        now = time.monotonic()
        renew = silence.heard(published, now)
        if topic.count or not topic.listeners:
            return
        if silence.is_unsent(now) and subscription.ask_in_json():
            return
        if renew:
            subscription.renew()
