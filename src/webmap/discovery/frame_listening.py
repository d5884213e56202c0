"""Listens to frames for a short time: before a robot is shown, and repeatedly later."""

import asyncio
import weakref
from collections.abc import Mapping
from functools import partial

from webmap.base.errors import BridgeClosed
from webmap.base.looking import looking
from webmap.base.scope import no_scope
from webmap.discovery.tf_robots import Trees
from webmap.ros.bridge import Bridge, TemporaryBridge
from webmap.ros.messages import TFMessage
from webmap.ros.names import is_topic

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


class LateFrames:
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

        While nobody looks, it does not listen: a robot that has only ``/tf`` is found
        when a page is open.

        Args:
            topics: Types by topic, as the bridge lists them.
            seconds: How long to listen.

        """
        wanted = frame_topics(topics)[:MOST_TOPICS]
        if not wanted or not looking.somebody:
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
        try:
            await asyncio.sleep(seconds)
        finally:
            for subscription in subscriptions:
                subscription.remove()
        return self.trees

    def _receive(self, namespace: str, message: TFMessage) -> None:
        for each in message.transforms:
            self.trees.take(namespace, each.frame_id, each.child_frame_id)


_late: weakref.WeakKeyDictionary[Bridge, LateFrames] = weakref.WeakKeyDictionary()


def late_frames(bridge: Bridge) -> LateFrames:
    """Return the listener for the frames of a bridge; each bridge has one."""
    if bridge not in _late:
        _late[bridge] = LateFrames(bridge)
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
    if not frame_topics(topics):
        return Trees()
    async with TemporaryBridge(url) as bridge:
        try:
            await bridge.open()
        except BridgeClosed:
            # It answered a moment ago; the next connection reports that it is gone.
            return Trees()
        return await LateFrames(bridge).listen(topics, seconds=seconds)
