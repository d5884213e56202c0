"""Subscribing again to topics that are silent, once somebody publishes them.

A bridge of ROS 2 chooses how it subscribes by those who publish a topic at that moment.
A map that is published later and once, or a topic whose type was not stated, would
never come; nor would either come by itself. So who is silent is looked after.
A message above ``max_message_size`` does not come in CBOR at all: after some time it is
asked for in JSON.
"""

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterable

from webmap.ros.subscriptions import Topic
from webmap.scope import no_scope

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
    """Looks after the silent topics of one bridge.

    Args:
        published: Asks the bridge whether anybody publishes a topic.
        topics: What is subscribed to now.

    """

    def __init__(
        self,
        published: Callable[[str], Awaitable[bool | None]],
        topics: Callable[[], Iterable[Topic]],
    ) -> None:
        self._published = published
        self._topics = topics
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
        silent: dict[Topic, Silence] = {}
        while True:
            await asyncio.sleep(PERIOD)
            now = time.monotonic()
            wanted = [topic for topic in self._topics() if not topic.count]
            silent = {t: silent.get(t) or Silence(now) for t in wanted}
            for topic, silence in silent.items():
                if silence.due(now):
                    await self._look(topic, silence)

    async def _look(self, topic: Topic, silence: Silence) -> None:
        published = None
        if self._unanswered < UNANSWERED:
            published = await self._published(topic.name)
            self._unanswered = self._unanswered + 1 if published is None else 0
        now = time.monotonic()
        renew = silence.heard(published, now)
        if topic.count or not topic.listeners:
            return
        if silence.is_unsent(now) and topic.ask_in_json():
            return
        if renew:
            topic.renew()
