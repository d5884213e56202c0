"""Finding out, for people, what bridges leave unsaid.

Most bridges meet a subscription with a wrong type with silence, and send a message of
whatever type the topic has where none was stated. Rosapi then tells what is wrong.
"""

import asyncio
import logging
from collections.abc import Callable, Coroutine
from typing import Any

from webmap.errors import BridgeError, ProtocolError
from webmap.ros import large
from webmap.ros.decoding import Unreadable
from webmap.ros.graph import Graph
from webmap.ros.limits import TooLarge
from webmap.ros.names import is_type, same_type
from webmap.ros.renewal import IN_CBOR
from webmap.ros.subscriptions import Topic
from webmap.scope import no_scope

log = logging.getLogger("webmap.ros")

SILENCE = 3.0
"""How long a topic of a stated type may be silent before its type is asked, in s."""


class Doubts:
    """The questions about one bridge's topics, each of them asked once.

    Args:
        name: What people call the bridge.
        graph: Knows the topics' types.
        report: Is told what was found out.

    """

    def __init__(
        self, name: str, graph: Graph, report: Callable[[Exception], None]
    ) -> None:
        self._name = name
        self._graph = graph
        self._report = report
        self._tasks: set[asyncio.Task[None]] = set()

    def message_failed(self, topic: Topic, expected: str, error: ProtocolError) -> None:
        """Report a message that does not decode, with the type that it really has."""
        if isinstance(error, TooLarge):
            self._told(topic, TooLarge(f"{topic.name}: {error}"), error)
            return
        if isinstance(error, Unreadable):
            # No type would make sense of it, so none is asked for or named.
            words = "got a frame that was cut off, or is not one message"
            self._told(topic, ProtocolError(f"{topic.name}: {words}: {error}"), error)
            return
        self._ask(self._explain(topic, expected, error))

    def too_large(self, topic: Topic, size: int | None) -> None:
        """Report a topic whose messages are too large for the bridge's CBOR.

        Args:
            topic: The topic.
            size: Bytes of a message in JSON; None if links ended before one came.

        """
        # A page shows three lines: what to do comes before the details.
        if size is None:
            words = (
                f"{topic.name}: nothing came in CBOR for {IN_CBOR:g} s, though it is "
                f"published, and the link ended before it came in JSON. If it is "
                f"larger than max_message_size of rosbridge_websocket, set that higher"
            )
        else:
            words = (
                f"{topic.name} is larger than the bridge sends in CBOR: set "
                f"max_message_size of rosbridge_websocket to {size} or more. Until "
                f"then it comes in JSON, once in {large.THROTTLE // 60_000} minutes"
            )
        fault = BridgeError(words)
        log.warning("%s: %s", self._name, fault)
        self._report(fault)
        topic.over(fault)

    def watch(self, topic: Topic) -> None:
        """Report a topic that stays silent because its type was stated wrongly."""
        if topic.message_type is not None:
            self._ask(self._explain_silence(topic))

    async def stop(self) -> None:
        """Ask no more."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def forget(self) -> None:
        """Drop the questions about a link that has ended."""
        for task in self._tasks:
            task.cancel()

    async def _explain(self, topic: Topic, expected: str, error: ProtocolError) -> None:
        got = await self._graph.topic_type(topic.name)
        said = f"the bridge says it is {got}" if got else "its type is not known"
        words = f"expected {expected}, {said}"
        if got and is_type(got, expected):
            words = f"got what is no whole {got}, though the bridge says it is"
        self._told(topic, ProtocolError(f"{topic.name}: {words}: {error}"), error)

    def _told(self, topic: Topic, full: ProtocolError, error: ProtocolError) -> None:
        log.warning("%s: %s", self._name, full)
        self._report(full)
        topic.failed(full, error)

    async def _explain_silence(self, topic: Topic) -> None:
        await asyncio.sleep(SILENCE)
        if topic.count or not topic.listeners:
            return
        got = await self._graph.topic_type(topic.name)
        wanted = topic.message_type
        if got is None or wanted is None or topic.count or same_type(got, wanted):
            return
        topic.silent()

    def _ask(self, question: Coroutine[Any, Any, None]) -> None:
        with no_scope():
            task = asyncio.get_running_loop().create_task(question)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
