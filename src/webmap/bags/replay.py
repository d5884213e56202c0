"""A recording as a ROS system that can only be read."""

import asyncio
from collections.abc import Callable
from typing import Any

from webmap.bags.recording import Recorded, Recording, StaticFrames, is_static
from webmap.bags.times import Pace, Stamps
from webmap.ros.rosbridge.server.graph import (
    BRIDGE_NODE,
    Deliver,
    Graph,
    GraphError,
    ServiceHandler,
)
from webmap.ros.rosbridge.server.quirks import POLITE
from webmap.ros.rosbridge.server.rosapi import Rosapi
from webmap.ros.rosbridge.server.schema import Schema

NODE = "/recording"
"""The node that publishes the recorded messages."""

STATUS = "/webmap/recording"
"""Topic with the name and position of the recording; a ``std_msgs/String``.

Only the replay publishes it: it is neither recorded nor played from a recording.
"""

REFUSED = "this is a recording: it accepts no messages, services or actions"


class ReplayGraph(Graph):
    """A ROS graph that accepts no publishers or services once it is sealed.

    Clients may subscribe and ask questions; no node would follow their commands.
    """

    def __init__(self, schema: Schema, *, clock: Callable[[], float]) -> None:
        super().__init__(schema, clock=clock)
        self.subscribed = asyncio.Event()
        """Set at the first subscription."""
        self._sealed = False

    def seal(self) -> None:
        """Refuse all new publishers and services from now on."""
        self._sealed = True

    def advertise(
        self,
        owner: object,
        name: str,
        type_name: str,
        *,
        node: str = BRIDGE_NODE,
        latch: bool = False,
    ) -> None:
        """Register ``owner`` as publisher of a topic, unless the graph is sealed.

        Raises:
            GraphError: If the graph is sealed, or as in :meth:`Graph.advertise`.

        """
        self._refuse()
        super().advertise(owner, name, type_name, node=node, latch=latch)

    def serve(
        self,
        owner: object,
        name: str,
        type_name: str,
        handle: ServiceHandler,
        *,
        node: str = BRIDGE_NODE,
    ) -> None:
        """Register ``owner`` as the server of a service, unless the graph is sealed.

        Raises:
            GraphError: If the graph is sealed.

        """
        self._refuse()
        super().serve(owner, name, type_name, handle, node=node)

    def subscribe(
        self,
        owner: object,
        name: str,
        deliver: Deliver,
        type_name: str | None = None,
        *,
        node: str = BRIDGE_NODE,
    ) -> None:
        """Subscribe ``owner`` to a topic, and deliver its latched messages.

        Raises:
            GraphError: As in :meth:`Graph.subscribe`.

        """
        super().subscribe(owner, name, deliver, type_name, node=node)
        self.subscribed.set()

    def _refuse(self) -> None:
        if self._sealed:
            raise GraphError(REFUSED)


class Replay:
    """Publishes recorded messages as if they came now.

    Args:
        recording: The recording.
        clock: Returns the time in seconds since 1970.

    """

    def __init__(self, recording: Recording, clock: Callable[[], float]) -> None:
        self.recording = recording
        self.graph = ReplayGraph(recording.schema, clock=clock)
        self._stamps = Stamps(recording.schema)
        self._static: dict[str, StaticFrames] = {}

    def start(self) -> None:
        """Advertise all topics of the recording, and seal the graph."""
        for topic in self.recording.topics.values():
            if topic.name == STATUS:
                continue
            self.graph.advertise(
                self, topic.name, topic.type, node=NODE, latch=topic.latched
            )
            if is_static(topic.name) and topic.type == "tf2_msgs/TFMessage":
                self._static[topic.name] = StaticFrames()
        self.graph.advertise(self, STATUS, "std_msgs/String", node=NODE, latch=True)
        Rosapi(self.graph, POLITE).start()
        self.graph.seal()

    def publish(self, recorded: Recorded, pace: Pace) -> None:
        """Publish a message with shifted stamps, if there is a subscriber."""
        name = recorded.topic
        if name == STATUS or not self.graph.is_wanted(name):
            return
        message: dict[str, Any] | None = self.recording.message(recorded)
        if message is None:
            return
        type_name = self.recording.topics[name].type
        self._stamps.move(type_name, message, pace.moved)
        if name in self._static:
            message = self._static[name].with_all(message)
        self.graph.publish(self, name, message)

    def publish_status(self, text: str) -> None:
        """Publish the status of the replay, for people."""
        self.graph.publish(self, STATUS, {"data": text})
