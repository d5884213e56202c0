"""A recording as a ROS system that can only be read."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from webmap.bags.recording import FRAMES, AllFrames, Recorded, Recording, is_static
from webmap.bags.status import MARKS, STATUS, TYPE, Marks, Status, text_of
from webmap.bags.times import Pace, Stamps
from webmap.ros.rosbridge.server.dialect import POLITE
from webmap.ros.rosbridge.server.graph import (
    BRIDGE_NODE,
    Deliver,
    Graph,
    GraphError,
    ServiceHandler,
)
from webmap.ros.rosbridge.server.rosapi import Rosapi
from webmap.ros.rosbridge.server.schema import Schema

NODE = "/recording"
"""The node that publishes the recorded messages."""

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
        self._static: dict[str, AllFrames] = {}

    def start(self) -> None:
        """Advertise all topics of the recording, and seal the graph."""
        for topic in self.recording.topics.values():
            if topic.name in (STATUS, MARKS):
                continue
            self.graph.advertise(
                self, topic.name, topic.type, node=NODE, latch=topic.latched
            )
        for name in (STATUS, MARKS):
            self.graph.advertise(self, name, TYPE, node=NODE, latch=True)
        self.forget()
        Rosapi(self.graph, POLITE).start()
        self.graph.seal()

    def forget(self) -> None:
        """Forget all latched messages: they may be from after the next position."""
        for topic in self.recording.topics.values():
            if topic.name not in (STATUS, MARKS):
                self.graph.forget_latched(self, topic.name)
            if is_static(topic.name) and topic.type == FRAMES:
                self._static[topic.name] = AllFrames()

    def publish(self, recorded: Recorded, pace: Pace) -> None:
        """Publish a message with shifted stamps, if there is a subscriber."""
        message = self._message(recorded, pace)
        if message is None:
            return
        if recorded.topic in self._static:
            message = self._static[recorded.topic].with_all(message)
        self.graph.publish(self, recorded.topic, message)

    def publish_state(self, state: Sequence[Recorded], pace: Pace) -> None:
        """Publish the state at a position, the frames of each topic as one message."""
        frames: dict[str, AllFrames] = {}
        whole: dict[str, dict[str, Any]] = {}
        for recorded in state:
            name = recorded.topic
            if self.recording.topics[name].type != FRAMES:
                self.publish(recorded, pace)
            elif (message := self._message(recorded, pace)) is not None:
                known = self._static.get(name) or frames.setdefault(name, AllFrames())
                whole[name] = known.with_all(message)
        for name, message in whole.items():
            self.graph.publish(self, name, message)

    def publish_status(self, status: Status) -> None:
        """Publish the position."""
        self.graph.publish(self, STATUS, {"data": text_of(status)})

    def publish_marks(self, marks: Marks) -> None:
        """Publish the marks on the time line."""
        self.graph.publish(self, MARKS, {"data": text_of(marks)})

    def _message(self, recorded: Recorded, pace: Pace) -> dict[str, Any] | None:
        name = recorded.topic
        if name in (STATUS, MARKS) or not self.graph.is_wanted(name):
            return None
        message: dict[str, Any] | None = self.recording.message(recorded)
        if message is None:
            return None
        topic = self.recording.topics[name]
        if topic.latched:  # said once: its age is right, however old it is
            pace = replace(pace, earliest=0)
        self._stamps.move(topic.type, message, pace.moved)
        return message
