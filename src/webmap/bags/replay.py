"""A recording as a ROS system that can be listened to, and told nothing."""

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
"""The node that publishes what was recorded."""

STATUS = "/webmap/recording"
"""Where it is said which recording is played, and where in it; a ``std_msgs/String``.

It is the replay's own: it is neither recorded nor taken from a recording."""

REFUSED = "this is a recording: nothing is taken in"


class ReplayGraph(Graph):
    """A ROS graph that takes nothing in once it is sealed.

    Whoever connects may subscribe and ask questions; there is nobody who would obey.
    """

    def __init__(self, schema: Schema, *, clock: Callable[[], float]) -> None:
        super().__init__(schema, clock=clock)
        self.heard = asyncio.Event()
        """Set when somebody listens."""
        self._sealed = False

    def seal(self) -> None:
        """Let nobody publish or serve any more who did not before."""
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
        """Let ``owner`` publish on a topic, unless the graph is sealed.

        Raises:
            GraphError: If it is, or as of any graph.

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
        """Let ``owner`` answer a service, unless the graph is sealed.

        Raises:
            GraphError: If it is.

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
        """Let ``owner`` hear a topic, what is latched included.

        Raises:
            GraphError: As of any graph.

        """
        super().subscribe(owner, name, deliver, type_name, node=node)
        self.heard.set()

    def _refuse(self) -> None:
        if self._sealed:
            raise GraphError(REFUSED)


class Replay:
    """Publishes recorded messages as if they were said now.

    Args:
        recording: Where they come from.
        clock: The time in seconds since 1970.

    """

    def __init__(self, recording: Recording, clock: Callable[[], float]) -> None:
        self.recording = recording
        self.graph = ReplayGraph(recording.schema, clock=clock)
        self._stamps = Stamps(recording.schema)
        self._static: dict[str, StaticFrames] = {}

    def start(self) -> None:
        """Tell of all topics of the recording, and let nobody add to them."""
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
        """Publish a message with its stamps moved, if anybody would get it."""
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

    def say(self, text: str) -> None:
        """Say how it stands with the replay, for people."""
        self.graph.publish(self, STATUS, {"data": text})
