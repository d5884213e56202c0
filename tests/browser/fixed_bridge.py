"""A rosbridge that always publishes the same messages."""

import asyncio
import contextlib
import itertools
import re
import threading
import time
from collections.abc import Iterator
from typing import Any

from fixed_site import LATCHED, STEPS, TYPES, site

from webmap.ros.rosbridge.server.dialect import Dialect, parse_quirks
from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.graph import Graph
from webmap.ros.rosbridge.server.rosapi import Rosapi
from webmap.ros.rosbridge.server.schema import Schema
from webmap.ros.rosbridge.server.server import RosbridgeServer

QUICK, SLOW = 0.2, 1.0
"""Seconds between two messages of a topic."""

SOON_OLD = re.compile(r"/(tf|odom|pose|pose2d|scan|ranges|sonar\w*|points)\Z")
"""Topics whose drawing becomes old after one or two seconds."""

SUBSCRIBED = {
    "/anna/cmd_vel": "geometry_msgs/Twist",
    "/bert/cmd_vel": "geometry_msgs/Twist",
}
"""Topics to which the robots subscribe without an effect."""


class FixedBridge:
    """Publishes all messages of :func:`fixed_site.site`, repeatedly."""

    def __init__(self, dialect: str) -> None:
        quirks = parse_quirks("real", dialect)
        self.schema = Schema(Dialect(dialect))
        self.schema.define(TYPES)
        self.graph = Graph(self.schema)
        Rosapi(self.graph, quirks).start()
        self.server = RosbridgeServer(self.graph, Encoder(self.schema, quirks))
        self.url = ""
        self.step = 0
        self._sites = [
            self._whole(site(step, ros2=dialect == "ros2"))
            for step in range(len(STEPS))
        ]

    def _whole(self, messages: dict[str, Any]) -> dict[str, Any]:
        return {
            topic: (type, self.schema.conform(type, message))
            for topic, (type, message) in messages.items()
        }

    async def run(self, stop: threading.Event) -> None:
        """Publish all messages until the bridge is stopped."""
        for topic, (type, message) in self._sites[0].items():
            latch = topic in LATCHED
            self.graph.advertise(self, topic, type, node="/site", latch=latch)
            if latch:
                self.graph.publish(self, topic, self._now(message, time.time()))
        for topic, type in SUBSCRIBED.items():
            self.graph.subscribe(self, topic, lambda _: None, type, node="/site")
        for turn in itertools.count():
            if stop.is_set():
                break
            self._publish(all_of_them=turn % round(SLOW / QUICK) == 0)
            await asyncio.sleep(QUICK)
        await self.server.stop()

    def _publish(self, *, all_of_them: bool) -> None:
        stamp = time.time()
        for topic, (_, message) in self._sites[self.step].items():
            due = topic not in LATCHED and (all_of_them or SOON_OLD.search(topic))
            if due and self.graph.is_wanted(topic):
                self.graph.publish(self, topic, self._now(message, stamp))

    def _now(self, message: Any, stamp: float) -> Any:
        """Return a message with the current time in every header."""
        if isinstance(message, list) and message and isinstance(message[0], dict):
            return [self._now(each, stamp) for each in message]
        if not isinstance(message, dict):
            return message
        time_of = self.schema.dialect.time(stamp)
        return {
            key: time_of if key == "stamp" else self._now(value, stamp)
            for key, value in message.items()
        }


@contextlib.contextmanager
def fixed_bridge(
    dialect: str, kind: type[FixedBridge] = FixedBridge
) -> Iterator[FixedBridge]:
    """Run a :class:`FixedBridge` in a separate thread."""
    bridge = kind(dialect)
    ready, stop = threading.Event(), threading.Event()

    async def run() -> None:
        bridge.url = await bridge.server.start("127.0.0.1", 0)
        ready.set()
        await bridge.run(stop)

    thread = threading.Thread(target=lambda: asyncio.run(run()))
    thread.start()
    try:
        assert ready.wait(30)
        yield bridge
    finally:
        stop.set()
        thread.join(20)
