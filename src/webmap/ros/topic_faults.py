"""Search for the reason why the messages of a topic cannot be used.

For a subscription with a wrong type most bridges send nothing; for one without a type
they send messages of any type. So WebMap asks the bridge for the type.
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any

from webmap.base.errors import ProtocolError
from webmap.base.scope import no_scope
from webmap.ros.decoding import Unreadable
from webmap.ros.limits import TooLarge
from webmap.ros.names import is_type, same_type
from webmap.ros.subscriptions import Topic

log = logging.getLogger("webmap.ros")

SILENCE = 3.0
"""Seconds without messages after which the stated type of a topic is checked."""


class TopicFaults:
    """The questions about the topics of one bridge, each asked once.

    Args:
        name: The bridge's name, as shown to people.
        topic_type: Asks the bridge for the type of a topic.
        report: Called with each fault that was found.

    """

    def __init__(
        self,
        name: str,
        topic_type: Callable[[str], Awaitable[str | None]],
        report: Callable[[Exception], None],
    ) -> None:
        self._name = name
        self._topic_type = topic_type
        self._report = report
        self._tasks: set[asyncio.Task[None]] = set()

    def message_failed(self, topic: Topic, expected: str, error: ProtocolError) -> None:
        """Report a message that does not decode, with the actual type of the topic."""
        if isinstance(error, TooLarge):
            self._found(topic, TooLarge(f"{topic.name}: {error}"), error)
            return
        if isinstance(error, Unreadable):
            # The frame matches no type, so do not ask for the type.
            text = "got a frame that was cut off, or is not one message"
            self._found(topic, ProtocolError(f"{topic.name}: {text}: {error}"), error)
            return
        self._begin(self._explain(topic, expected, error))

    def watch(self, topic: Topic) -> None:
        """Report a topic that sends nothing because its stated type is wrong."""
        if topic.message_type is not None:
            self._begin(self._explain_silence(topic))

    async def stop(self) -> None:
        """Cancel all questions and wait for their end."""
        tasks = list(self._tasks)
        self.forget()
        await asyncio.gather(*tasks, return_exceptions=True)

    def forget(self) -> None:
        """Cancel the questions about a connection that has ended."""
        for task in self._tasks:
            task.cancel()

    async def _explain(self, topic: Topic, expected: str, error: ProtocolError) -> None:
        got = await self._topic_type(topic.name)
        actual = f"the bridge reports {got}" if got else "its type is not known"
        text = f"expected {expected}, {actual}"
        if got and is_type(got, expected):
            text = f"the bridge reports {got}, but a field is missing or wrong"
        self._found(topic, ProtocolError(f"{topic.name}: {text}: {error}"), error)

    def _found(self, topic: Topic, full: ProtocolError, error: ProtocolError) -> None:
        log.warning("%s: %s", self._name, full)
        self._report(full)
        topic.failed(full, error)

    async def _explain_silence(self, topic: Topic) -> None:
        await asyncio.sleep(SILENCE)
        if topic.count or not topic.listeners:
            return
        got = await self._topic_type(topic.name)
        stated = topic.message_type
        if got is None or stated is None or topic.count or same_type(got, stated):
            return
        topic.silent()

    def _begin(self, question: Coroutine[Any, Any, None]) -> None:
        with no_scope():
            task = asyncio.get_running_loop().create_task(question)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
