"""Finding out, for people, why the messages of a topic cannot be used.

Most bridges meet a subscription with a wrong type with silence, and send a message of
whatever type the topic has where none was stated. So the bridge is asked for the type.
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
"""How long a topic of a stated type may be silent before its type is asked, in s."""


class TopicFaults:
    """The questions about one bridge's topics, each of them asked once.

    Args:
        name: What people call the bridge.
        topic_type: Asks the bridge for the type of a topic.
        report: Is told of each fault that was found.

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
        """Report a message that does not decode, with the type that it really has."""
        if isinstance(error, TooLarge):
            self._found(topic, TooLarge(f"{topic.name}: {error}"), error)
            return
        if isinstance(error, Unreadable):
            # No type would make sense of it, so none is asked for or named.
            words = "got a frame that was cut off, or is not one message"
            self._found(topic, ProtocolError(f"{topic.name}: {words}: {error}"), error)
            return
        self._begin(self._explain(topic, expected, error))

    def watch(self, topic: Topic) -> None:
        """Report a topic that stays silent because its type was stated wrongly."""
        if topic.message_type is not None:
            self._begin(self._explain_silence(topic))

    async def stop(self) -> None:
        """Ask no more."""
        tasks = list(self._tasks)
        self.forget()
        await asyncio.gather(*tasks, return_exceptions=True)

    def forget(self) -> None:
        """Drop the questions about a link that has ended."""
        for task in self._tasks:
            task.cancel()

    async def _explain(self, topic: Topic, expected: str, error: ProtocolError) -> None:
        got = await self._topic_type(topic.name)
        said = f"the bridge says it is {got}" if got else "its type is not known"
        words = f"expected {expected}, {said}"
        if got and is_type(got, expected):
            words = f"got what is no whole {got}, though the bridge says it is"
        self._found(topic, ProtocolError(f"{topic.name}: {words}: {error}"), error)

    def _found(self, topic: Topic, full: ProtocolError, error: ProtocolError) -> None:
        log.warning("%s: %s", self._name, full)
        self._report(full)
        topic.failed(full, error)

    async def _explain_silence(self, topic: Topic) -> None:
        await asyncio.sleep(SILENCE)
        if topic.count or not topic.listeners:
            return
        got = await self._topic_type(topic.name)
        wanted = topic.message_type
        if got is None or wanted is None or topic.count or same_type(got, wanted):
            return
        topic.silent()

    def _begin(self, question: Coroutine[Any, Any, None]) -> None:
        with no_scope():
            task = asyncio.get_running_loop().create_task(question)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
