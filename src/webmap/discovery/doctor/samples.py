"""Listens to topics: the count and age of their messages, and where frames lead."""

import asyncio
import contextlib
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import msgspec

from webmap.base.errors import ProtocolError
from webmap.base.scope import no_scope
from webmap.discovery.doctor.facts import Measurement
from webmap.discovery.tf_robots import MAP
from webmap.ros.bridge import Bridge
from webmap.ros.messages import Header, TFMessage
from webmap.ros.received_message import ReceivedMessage
from webmap.ros.subscriptions import Encoding
from webmap.ros.tf import Buffer, TransformError

ENOUGH = 4
"""Messages after which a topic is unsubscribed: they give three intervals."""

MOST_BYTES = 1 << 21
"""Bytes of one topic after which it is unsubscribed, whatever the count."""

MOST_BYTES_IN_ALL = 1 << 24
"""Bytes after which all topics are unsubscribed, to spare a radio link."""

FRAMES_AT_ONCE = 100
"""Queue length of topics with frames in the bridge; no message may be lost."""


class _Stamped(msgspec.Struct, frozen=True):
    header: Header = Header()
    child_frame_id: str = ""


class TopicSamples:
    """Counts the messages of topics.

    Args:
        topics: The topics; messages of others are ignored.
        now: When listening begins, on the monotonic clock.

    """

    def __init__(self, topics: Iterable[str], now: float) -> None:
        self._began = now
        topics = tuple(topics)
        self._last = dict.fromkeys(topics, now)
        self._gap = dict.fromkeys(topics, 0.0)
        self._measured = {topic: Measurement() for topic in topics}
        self._newest: dict[str, tuple[ReceivedMessage, float]] = {}

    def received(self, message: ReceivedMessage, now: float, wall: float) -> None:
        """Count a message.

        Args:
            message: The message.
            now: When it came, on the monotonic clock.
            wall: The same time on this machine's wall clock, in seconds.

        """
        topic = message.topic
        measured = self._measured.get(topic)
        if measured is None:
            return
        if measured.count:  # the time before the first one is needed to subscribe
            self._gap[topic] = max(self._gap[topic], now - self._last[topic])
        self._last[topic] = now
        self._newest[topic] = (message, wall)
        self._measured[topic] = Measurement(
            measured.count + 1,
            bytes=measured.bytes + message.size,
        )

    def end(self, now: float) -> dict[str, Measurement]:
        """Return what was measured of each topic; ``now`` is monotonic seconds."""
        return {topic: self.end_of(topic, now) for topic in self._measured}

    def end_of(self, topic: str, now: float) -> Measurement:
        """Return what was measured of one topic, as :meth:`end` does."""
        measured, seconds = self._measured[topic], now - self._began
        gap = max(self._gap[topic], now - self._last[topic])
        if topic not in self._newest:
            return Measurement(seconds=seconds, longest_gap=gap)
        message, wall = self._newest[topic]
        frame, child, stamp, trouble = "", "", None, ""
        try:
            stamped = message.decode(_Stamped)
            frame, child = stamped.header.frame_id, stamped.child_frame_id
            stamp = stamped.header.stamp.seconds or None
        except ProtocolError as error:
            trouble = str(error)
        return replace(
            measured,
            seconds=seconds,
            longest_gap=gap,
            frame=frame,
            child=child,
            stamp=stamp,
            arrived=wall,
            binary=message.is_binary,
            trouble=trouble,
        )


class FrameCheck:
    """Collects the messages on the topics with frames, of all namespaces."""

    def __init__(self) -> None:
        self._buffers: dict[str, Buffer] = {}
        self._refused: dict[str, list[str]] = {}

    def received(self, message: ReceivedMessage) -> None:
        """Process a message of ``tf`` or ``tf_static``."""
        namespace, _, name = message.topic.rpartition("/")
        buffer = self._buffers.setdefault(namespace, Buffer())
        refused = self._refused.setdefault(namespace, [])
        try:
            rows = message.decode(TFMessage).rows
        except ProtocolError as error:
            refused.append(f"{message.topic} cannot be read: {error}")
            return
        for row in rows:
            try:
                buffer.add_row(row, static=name == "tf_static", namespace=namespace)
            except TransformError as error:
                refused.append(str(error))

    def oddities(self, namespace: str) -> tuple[str, ...]:
        """Return the oddities in the frames of a namespace, each once."""
        buffer = self._buffers.get(namespace)
        notes = [] if buffer is None else list(buffer.notes)
        return tuple(dict.fromkeys([*self._refused.get(namespace, ()), *notes]))

    def missing(self, namespace: str, frame: str, start: str = MAP) -> str:
        """Return why no transform leads from one frame to another; empty if one does.

        Args:
            namespace: Namespace of the topic with the frames.
            frame: The frame at the end.
            start: The frame at the start.

        """
        buffer = self._buffers.get(namespace)
        if buffer is None:
            return f"no message was received on {namespace}/tf"
        name, start = buffer.name(frame, namespace), buffer.name(start, namespace)
        if name == start:
            return ""
        try:
            buffer.lookup(start, name)
        except TransformError as error:
            return str(error)
        return ""


class Sampling:
    """Listens to topics until each has sent enough messages.

    Args:
        topics: The topics.
        now: When listening begins, on the monotonic clock.
        enough: Messages after which a topic is unsubscribed.

    """

    def __init__(
        self, topics: Iterable[str], now: float, *, enough: int = ENOUGH
    ) -> None:
        self._enough = enough
        self._topics = tuple(topics)
        self._listening = TopicSamples(self._topics, now)
        self._bytes = dict.fromkeys(self._topics, 0)
        self._came: dict[str, list[float]] = {topic: [] for topic in self._topics}
        self._left: dict[str, Measurement] = {}

    @property
    def done(self) -> bool:
        """Whether listening is complete."""
        too_much = sum(self._bytes.values()) >= MOST_BYTES_IN_ALL
        return too_much or len(self._left) == len(self._topics)

    def received(self, message: ReceivedMessage, now: float, wall: float) -> bool:
        """Count a message, and return whether to unsubscribe its topic now.

        Args:
            message: The message.
            now: When it came, on the monotonic clock.
            wall: The same time on this machine's wall clock, in seconds.

        """
        topic = message.topic
        if topic not in self._bytes or topic in self._left:
            return False
        self._listening.received(message, now, wall)
        self._bytes[topic] += message.size
        self._came[topic].append(now)
        if len(self._came[topic]) < self._enough and self._bytes[topic] < MOST_BYTES:
            return False
        self._left[topic] = self._measured(topic, now)
        return True

    def end(self, now: float) -> dict[str, Measurement]:
        """Return the measurements; without silent topics if the limit ended them."""
        found = {
            topic: self._left.get(topic) or self._measured(topic, now)
            for topic in self._topics
        }
        cut = sum(self._bytes.values()) >= MOST_BYTES_IN_ALL
        return {topic: each for topic, each in found.items() if each.count or not cut}

    def _measured(self, topic: str, now: float) -> Measurement:
        came = self._came[topic]
        every = (came[-1] - came[0]) / (len(came) - 1) if len(came) > 1 else 0.0
        return replace(self._listening.end_of(topic, now), every=every)


async def listen(
    bridge: Bridge,
    topics: Mapping[str, Encoding],
    seconds: float,
    tf: Sequence[str] = (),
    frames: FrameCheck | None = None,
) -> dict[str, Measurement]:
    """Listen to topics for a time.

    Args:
        bridge: The bridge, connected.
        topics: The encoding of each topic.
        seconds: How long to listen.
        tf: Topics with frames.
        frames: Receives the messages of those.

    Returns:
        The measurements of each topic, also of those with frames.

    """
    if not (topics or tf):
        return {}
    listening = TopicSamples([*topics, *tf], time.monotonic())

    def received(message: ReceivedMessage) -> None:
        if frames is not None and message.topic in tf:
            frames.received(message)
        listening.received(message, time.monotonic(), time.time())

    with no_scope():
        subscriptions = [
            bridge.subscribe(topic, received, encoding=encoding)
            for topic, encoding in topics.items()
        ]
        subscriptions += [
            bridge.subscribe(topic, received, queue_length=FRAMES_AT_ONCE)
            for topic in tf
        ]
    for subscription in subscriptions:
        subscription.undecoded = True
    await asyncio.sleep(seconds)
    for subscription in subscriptions:
        subscription.remove()
    return listening.end(time.monotonic())


async def sample(
    bridge: Bridge,
    topics: Mapping[str, str],
    seconds: float,
    received: Callable[[ReceivedMessage], object],
    *,
    enough: int = ENOUGH,
    encoding: Encoding = "binary",
    throttle: int = 0,
) -> dict[str, Measurement]:
    """Listen to a few messages of each topic, which may be large.

    Args:
        bridge: The bridge, connected.
        topics: The type of each topic.
        seconds: Most seconds to listen.
        received: Called with each message too.
        enough: Messages after which a topic is unsubscribed.
        encoding: The encoding of the messages.
        throttle: Least time between two messages of a topic, in milliseconds.

    Returns:
        The measurements of each topic.

    """
    sampling = Sampling(topics, time.monotonic(), enough=enough)
    done = asyncio.Event()

    def take(message: ReceivedMessage) -> None:
        received(message)
        if sampling.received(message, time.monotonic(), time.time()):
            subscriptions[message.topic].remove()
        if sampling.done:
            done.set()

    with no_scope():
        subscriptions = {
            topic: bridge.subscribe(
                topic, take, type, encoding=encoding, throttle=throttle
            )
            for topic, type in topics.items()
        }
    for subscription in subscriptions.values():
        subscription.undecoded = True
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(seconds):
            await done.wait()
    for subscription in subscriptions.values():
        subscription.remove()
    return sampling.end(time.monotonic())
