"""The pictures of one camera's topic, for one client: the newest, and no other."""

import asyncio
import logging

from webmap.sim.rosbridge.encode import Publication
from webmap.sim.rosbridge.graph import Graph

log = logging.getLogger("webmap.sim")

NODE = "/web_video_server"
COMPRESSED = "/compressed"
"""What stands behind the name of an image's topic where its JPEG pictures are."""

_TYPE = "sensor_msgs/CompressedImage"
_JPEG = b"\xff\xd8\xff"


def image_topics(graph: Graph) -> list[str]:
    """Return the topics of images whose pictures there are as JPEG."""
    return sorted(
        name.removesuffix(COMPRESSED)
        for name, topic in graph.topics.items()
        if topic.type == _TYPE and name.endswith(COMPRESSED)
    )


class NewestPicture:
    """Hears a camera's topic from when it is made until it is closed.

    Args:
        graph: Where the topic is.
        topic: Of the image; one of :func:`image_topics`.

    """

    def __init__(self, graph: Graph, topic: str) -> None:
        self._graph = graph
        self._topic = topic + COMPRESSED
        self._newest: tuple[bytes, float] | None = None
        self._came = asyncio.Event()
        graph.subscribe(self, self._topic, self._take, _TYPE, node=NODE)

    async def next(self) -> tuple[bytes, float]:
        """Wait for a picture that was not returned yet; of several, the newest.

        Returns:
            It, and its stamp in seconds.

        """
        while self._newest is None:
            self._came.clear()
            await self._came.wait()
        picture, self._newest = self._newest, None
        return picture

    def close(self) -> None:
        """Hear the topic no more."""
        self._graph.unsubscribe(self, self._topic)

    def _take(self, publication: Publication) -> None:
        data = publication.message["data"]
        if not data.startswith(_JPEG):
            log.warning("%s: left out what is no JPEG", self._topic)
            return
        self._newest = data, publication.stamp
        self._came.set()
