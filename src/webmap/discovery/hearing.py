"""Listening to frames for a moment, before anything else is there."""

import asyncio
import contextlib
import time
from collections.abc import Iterable, Mapping

from webmap.discovery.tf_robots import Trees
from webmap.errors import ProtocolError
from webmap.ros import ops
from webmap.ros.events import Publish
from webmap.ros.limits import MAX_FRAME
from webmap.ros.messages import TFMessage
from webmap.ros.names import is_topic
from webmap.ros.protocol import Protocol

SECONDS = 0.8
"""How long is listened: who moves tells of its frames ten times a second."""

QUEUE = 100
"""Messages that the bridge may hold back; each one counts."""

MOST_TOPICS = 100


def frame_topics(topics: Mapping[str, str]) -> list[str]:
    """Return the topics that tell of frames, with the static ones of each."""
    spaces = [
        name.removesuffix("/tf")
        for name, type in sorted(topics.items())
        if name.endswith("/tf") and is_topic(name) and type.strip() in _TYPES
    ]
    return [f"{space}/{name}" for space in spaces for name in ("tf_static", "tf")]


async def hear_frames(
    url: str, topics: Mapping[str, str], *, seconds: float = SECONDS
) -> Trees:
    """Return the frames that are told of behind a bridge; none if it is silent.

    Args:
        url: The bridge's address.
        topics: Types by topic, as rosapi tells them.
        seconds: How long to listen.

    """
    trees = Trees()
    wanted = frame_topics(topics)[:MOST_TOPICS]
    if not wanted:
        return trees
    # The bridge was there a moment ago; if it is not, whoever connects will say it.
    with contextlib.suppress(OSError, TimeoutError):
        await _listen(url, wanted, seconds, trees)
    return trees


async def _listen(url: str, topics: Iterable[str], seconds: float, into: Trees) -> None:
    from websockets.asyncio.client import connect
    from websockets.exceptions import WebSocketException

    protocol = Protocol()
    try:
        async with connect(
            url,
            max_size=MAX_FRAME,
            open_timeout=5.0,
            close_timeout=0.5,
            compression=None,
            proxy=None,
        ) as socket:
            for topic in topics:
                request = ops.subscribe(topic, id=topic, queue_length=QUEUE)
                await socket.send(request.decode())
            async with asyncio.timeout(seconds):
                while True:
                    frame = await socket.recv(decode=False)
                    event = protocol.receive(frame, time.monotonic())
                    if isinstance(event, Publish):
                        _take(event, into)
    except WebSocketException as error:
        raise OSError(str(error)) from None


def _take(event: Publish, into: Trees) -> None:
    namespace = event.topic.rpartition("/")[0]
    try:
        message = event.decode(TFMessage)
    except ProtocolError:
        return  # what nobody can read tells of no robot
    for each in message.transforms:
        into.take(namespace, each.frame_id, each.child_frame_id)


_TYPES = ("tf2_msgs/TFMessage", "tf2_msgs/msg/TFMessage")
