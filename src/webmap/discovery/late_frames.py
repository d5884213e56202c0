"""Frames that are told of while the robots of a bridge are shown already."""

import asyncio
import weakref
from collections.abc import Mapping
from functools import partial

from webmap.discovery.hearing import MOST_TOPICS, QUEUE, SECONDS, frame_topics
from webmap.discovery.tf_robots import Trees
from webmap.ros.bridge import Bridge
from webmap.ros.messages import TFMessage
from webmap.scope import no_scope

TYPE = "tf2_msgs/TFMessage"


class LateFrames:
    """Listens to frames for a moment now and then, and keeps what it heard.

    So a robot of which nothing but ``/tf`` tells is found when it comes, at a fraction
    of what it would cost to listen all the time.

    Args:
        bridge: The link that the frames come over; what others hear of it is shared.

    """

    def __init__(self, bridge: Bridge) -> None:
        self._bridge = bridge
        self.trees = Trees()

    async def listen(
        self, topics: Mapping[str, str], *, seconds: float = SECONDS
    ) -> Trees:
        """Listen for a moment, and return all that was heard up to now.

        Args:
            topics: Types by topic, as rosapi tells them.
            seconds: How long to listen.

        """
        wanted = frame_topics(topics)[:MOST_TOPICS]
        if not wanted:
            return self.trees
        with no_scope():
            heard = [
                self._bridge.subscribe(
                    topic,
                    partial(self._hear, topic.rpartition("/")[0]),
                    TYPE,
                    decode=TFMessage,
                    queue_length=QUEUE,
                )
                for topic in wanted
            ]
        try:
            await asyncio.sleep(seconds)
        finally:
            for subscription in heard:
                subscription.remove()
        return self.trees

    def _hear(self, namespace: str, message: TFMessage) -> None:
        for each in message.transforms:
            self.trees.take(namespace, each.frame_id, each.child_frame_id)


_late: weakref.WeakKeyDictionary[Bridge, LateFrames] = weakref.WeakKeyDictionary()


def late_frames(bridge: Bridge) -> LateFrames:
    """Return what listens to the frames of a bridge; the same for all who ask."""
    if bridge not in _late:
        _late[bridge] = LateFrames(bridge)
    return _late[bridge]
