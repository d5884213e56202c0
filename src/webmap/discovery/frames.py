"""The frames behind a bridge, received for a short time, and repeatedly later."""

import asyncio
import weakref
from collections.abc import Mapping
from functools import partial

import msgspec

from webmap.base.audience import audience
from webmap.base.errors import BridgeClosed
from webmap.base.scope import no_scope
from webmap.discovery.rules import ODOMETRY, VELOCITY, nearest
from webmap.discovery.tf_robots import Trees
from webmap.ros.bridge import Bridge
from webmap.ros.messages import TFMessage
from webmap.ros.names import is_topic, is_type
from webmap.ros.temporary_bridge import TemporaryBridge
from webmap.ros.tf.buffer import names_of

SECONDS = 0.8
"""How long to listen: a robot that moves sends its frames ten times a second."""

QUEUE = 100
"""Queue length in the bridge; no message may be lost."""

MOST_TOPICS = 100

TYPE = "tf2_msgs/TFMessage"
_TYPES = (TYPE, "tf2_msgs/msg/TFMessage")


def frame_topics(topics: Mapping[str, str]) -> list[str]:
    """Return the topics with frames, with the static ones of each namespace."""
    spaces = [
        name.removesuffix("/tf")
        for name, type in sorted(topics.items())
        if name.endswith("/tf") and is_topic(name) and type.strip() in _TYPES
    ]
    return [f"{space}/{name}" for space in spaces for name in ("tf_static", "tf")]


class _Moved(msgspec.Struct, frozen=True):
    """The part of ``nav_msgs/Odometry`` that names the frame."""

    child_frame_id: str = ""


def odometry_topics(topics: Mapping[str, str]) -> list[str]:
    """Return the topics with odometry, if some may belong to one robot.

    They do not if each is in a namespace, other than the empty one, with a velocity.
    """
    types = {name: type.strip() for name, type in topics.items() if is_topic(name)}
    found = sorted(name for name in types if is_type(types[name], *ODOMETRY))
    driven = {n.rpartition("/")[0] for n in types if is_type(types[n], *VELOCITY)}
    clear = len(found) < 2 or all(nearest(name, driven) for name in found)
    return [] if clear else found


class FrameCollector:
    """Listens to frames for a short time, repeatedly, and keeps the results.

    This finds a robot that has only ``/tf`` when it appears, at a fraction of the cost
    of a permanent subscription.

    Args:
        bridge: The bridge; its subscriptions are shared with other users.

    """

    def __init__(self, bridge: Bridge) -> None:
        self._bridge = bridge
        self.trees = Trees()

    async def listen(
        self, topics: Mapping[str, str], *, seconds: float = SECONDS
    ) -> Trees:
        """Listen for a short time, and return all frames received up to now.

        While nobody looks, it does not listen to frames: a robot that has only ``/tf``
        is found when a page is open. One message of odometry is received in any case.

        Args:
            topics: Types by topic, as the bridge lists them.
            seconds: How long to listen.

        """
        wanted = frame_topics(topics)[:MOST_TOPICS] if audience.present else []
        unheard = sorted({*odometry_topics(topics)} - {*self.trees.odometry})
        if not (wanted or unheard):
            return self.trees
        with no_scope():
            subscriptions = [
                self._bridge.subscribe(
                    topic,
                    partial(self._receive, topic.rpartition("/")[0]),
                    TYPE,
                    decode=TFMessage,
                    queue_length=QUEUE,
                )
                for topic in wanted
            ]
            subscriptions += [
                self._bridge.subscribe(
                    topic,
                    partial(self._receive_odometry, topic),
                    topics[topic].strip(),
                    throttle=1000,  # one message is enough
                    decode=_Moved,
                )
                for topic in unheard[:MOST_TOPICS]
            ]
        try:
            await asyncio.sleep(seconds)
        finally:
            for subscription in subscriptions:
                subscription.remove()
        return self.trees

    def _receive(self, namespace: str, message: TFMessage) -> None:
        for row in message.rows:
            self.trees.take(namespace, *names_of(row))

    def _receive_odometry(self, topic: str, message: _Moved) -> None:
        self.trees.odometry[topic] = message.child_frame_id.strip().strip("/")


_late: weakref.WeakKeyDictionary[Bridge, FrameCollector] = weakref.WeakKeyDictionary()


def frame_collector(bridge: Bridge) -> FrameCollector:
    """Return the collector of a bridge; all callers of one bridge share it."""
    if bridge not in _late:
        _late[bridge] = FrameCollector(bridge)
    return _late[bridge]


async def receive_frames(
    url: str, topics: Mapping[str, str], *, seconds: float = SECONDS
) -> Trees:
    """Return the frames behind a bridge; none if it does not answer.

    Args:
        url: The bridge's address.
        topics: Types by topic, as the bridge lists them.
        seconds: How long to listen.

    """
    if not (frame_topics(topics) or odometry_topics(topics)):
        return Trees()
    async with TemporaryBridge(url) as bridge:
        try:
            await bridge.open()
        except BridgeClosed:
            # It answered a moment ago; the next connection reports that it is gone.
            return Trees()
        return await FrameCollector(bridge).listen(topics, seconds=seconds)
