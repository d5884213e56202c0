"""A few messages of each topic that may be large, and no more; without I/O."""

from collections.abc import Iterable
from dataclasses import replace

from webmap.discovery.doctor.listening import Listening
from webmap.discovery.doctor.observed import Heard
from webmap.ros.events import Publish

ENOUGH = 4
"""Messages after which a topic is left: three times between two of them."""

MOST_BYTES = 1 << 21
"""Of one topic, after which it is left though fewer came."""

MOST_BYTES_IN_ALL = 1 << 24
"""After which all topics are left: a radio link has more to do than to be looked at."""


class Sampling:
    """Listens to topics until each has said enough.

    Args:
        topics: Which.
        now: When listening begins, on the monotonic clock.
        enough: Messages after which a topic is left.

    """

    def __init__(
        self, topics: Iterable[str], now: float, *, enough: int = ENOUGH
    ) -> None:
        self._enough = enough
        self._topics = tuple(topics)
        self._listening = Listening(self._topics, now)
        self._bytes = dict.fromkeys(self._topics, 0)
        self._came: dict[str, list[float]] = {topic: [] for topic in self._topics}
        self._left: dict[str, Heard] = {}

    @property
    def done(self) -> bool:
        """Whether nothing more is to be heard."""
        too_much = sum(self._bytes.values()) >= MOST_BYTES_IN_ALL
        return too_much or len(self._left) == len(self._topics)

    def received(self, message: Publish, now: float, wall: float) -> bool:
        """Take a message, and tell whether its topic is to be left now.

        Args:
            message: The message.
            now: When it came, on the monotonic clock.
            wall: The same on this machine's wall clock, in seconds.

        """
        topic = message.topic
        if topic not in self._bytes or topic in self._left:
            return False
        self._listening.received(message, now, wall)
        self._bytes[topic] += len(message.frame)
        self._came[topic].append(now)
        if len(self._came[topic]) < self._enough and self._bytes[topic] < MOST_BYTES:
            return False
        self._left[topic] = self._heard(topic, now)
        return True

    def end(self, now: float) -> dict[str, Heard]:
        """Return what was heard until now; what was cut off in silence is left out."""
        found = {
            topic: self._left.get(topic) or self._heard(topic, now)
            for topic in self._topics
        }
        cut = sum(self._bytes.values()) >= MOST_BYTES_IN_ALL
        return {topic: each for topic, each in found.items() if each.count or not cut}

    def _heard(self, topic: str, now: float) -> Heard:
        came = self._came[topic]
        every = (came[-1] - came[0]) / (len(came) - 1) if len(came) > 1 else 0.0
        return replace(self._listening.end_of(topic, now), every=every)
