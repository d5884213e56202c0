"""What came on topics, counted; without I/O."""

from collections.abc import Iterable

import msgspec

from webmap.discovery.doctor.observed import Heard
from webmap.errors import ProtocolError
from webmap.ros import cbor
from webmap.ros.events import Publish
from webmap.ros.messages import Header


class _Stamped(msgspec.Struct, frozen=True):
    header: Header = Header()
    child_frame_id: str = ""


class Listening:
    """Counts the messages of topics.

    Args:
        topics: Which; only these count.
        now: When listening begins, on the monotonic clock.

    """

    def __init__(self, topics: Iterable[str], now: float) -> None:
        self._began = now
        topics = tuple(topics)
        self._last = dict.fromkeys(topics, now)
        self._gap = dict.fromkeys(topics, 0.0)
        self._heard = {topic: Heard() for topic in topics}
        self._newest: dict[str, tuple[Publish, float]] = {}

    def received(self, message: Publish, now: float, wall: float) -> None:
        """Take a message.

        Args:
            message: The message.
            now: When it came, on the monotonic clock.
            wall: The same on this machine's wall clock, in seconds.

        """
        topic = message.topic
        heard = self._heard.get(topic)
        if heard is None:
            return
        if heard.count:  # the time before the first is the bridge's, to subscribe
            self._gap[topic] = max(self._gap[topic], now - self._last[topic])
        self._last[topic] = now
        self._newest[topic] = (message, wall)
        self._heard[topic] = Heard(
            heard.count + 1,
            bytes=heard.bytes + len(message.frame),
            in_parts=heard.in_parts or message.in_parts,
        )

    def end(self, now: float) -> dict[str, Heard]:
        """Return what was heard until now."""
        return {topic: self._sum_up(topic, now) for topic in self._heard}

    def end_of(self, topic: str, now: float) -> Heard:
        """Return what was heard of one topic until now."""
        return self._sum_up(topic, now)

    def _sum_up(self, topic: str, now: float) -> Heard:
        heard, seconds = self._heard[topic], now - self._began
        gap = max(self._gap[topic], now - self._last[topic])
        if topic not in self._newest:
            return Heard(seconds=seconds, longest_gap=gap)
        message, wall = self._newest[topic]
        frame, child, stamp, trouble = "", "", None, ""
        try:
            stamped = message.decode(_Stamped)
            frame, child = stamped.header.frame_id, stamped.child_frame_id
            stamp = stamped.header.stamp.seconds or None
        except ProtocolError as error:
            trouble = str(error)
        return Heard(
            count=heard.count,
            seconds=seconds,
            longest_gap=gap,
            bytes=heard.bytes,
            frame=frame,
            child=child,
            stamp=stamp,
            arrived=wall,
            binary=cbor.looks_like_cbor(message.frame),
            in_parts=heard.in_parts,
            trouble=trouble,
        )
