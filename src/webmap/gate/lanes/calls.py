"""Service calls: each on a socket of its own, as some bridges wait for an answer."""

import asyncio
import logging
from collections.abc import Callable
from typing import Protocol

from websockets.exceptions import WebSocketException

from webmap.base.errors import BridgeClosed
from webmap.gate.lanes.budget import Budget
from webmap.gate.lanes.navigation import CallResult, answer_to, readable
from webmap.gate.lanes.sockets import SocketHandlers, open_socket

log = logging.getLogger("webmap.gate")

CALL_TIMEOUT = 2.0
"""The longest time for a service call, in seconds, including the connection."""

Ended = Callable[[str | None], None]
"""Called with the reason of a failure, or with ``None`` after a success."""


class Call(Protocol):
    """One call, in the protocol of one kind of bridge."""

    hello: bytes
    """What is sent at first; empty if the bridge speaks first."""

    def read(self, data: bytes) -> bytes | CallResult | None:
        """Return what to send next, or the result, if a message leads to one."""

    @property
    def why_silent(self) -> str | None:
        """Why no answer has come, if that is known."""


class RosbridgeCall:
    """A call at a rosbridge.

    Args:
        request: The operation that calls the service.
        id: The id of the call, which the answer repeats.

    """

    why_silent = None

    def __init__(self, request: bytes, id: str) -> None:
        self.hello = request
        self._id = id

    def read(self, data: bytes) -> CallResult | None:
        """Return the result, if a message has it."""
        return answer_to(data, self._id)


class ServiceCalls:
    """Calls services of one bridge and keeps track of the calls.

    Args:
        url: The bridge's address.

    """

    def __init__(self, url: str) -> None:
        self._url = url
        self._budget = Budget()
        self._calling: set[asyncio.Task[None]] = set()

    def call(self, call: Call, what: str, ended: Ended = lambda why: None) -> None:
        """Call a service without waiting for its answer.

        Args:
            call: The call.
            what: The purpose of the call, for the log.
            ended: Called with the outcome, unless :meth:`close` cancels the call.

        """
        work = self._call(call, what, ended)
        task = asyncio.get_running_loop().create_task(work)
        self._calling.add(task)
        task.add_done_callback(self._calling.discard)

    async def settle(self) -> None:
        """Wait until every call has ended."""
        if self._calling:
            await asyncio.wait(self._calling)

    def close(self) -> None:
        """Cancel the unanswered calls."""
        for task in self._calling:
            task.cancel()

    async def _call(self, call: Call, what: str, ended: Ended) -> None:
        why = await self._ask(call)
        if why is not None:
            log.warning("%s: %s", what, why)
        ended(why)

    async def _ask(self, call: Call) -> str | None:
        """Call a service; return why that failed, ``None`` if it did not."""
        news: asyncio.Queue[bytes | CallResult] = asyncio.Queue()

        def on_text(data: bytes) -> None:
            found = call.read(data)
            if found is not None:
                news.put_nowait(found)

        def lost(why: str) -> None:
            reason = readable(f"no answer: connection lost: {why}")
            news.put_nowait(CallResult(reason))

        handlers = SocketHandlers(text=on_text, pong=lambda _: None, lost=lost)
        try:
            async with asyncio.timeout(CALL_TIMEOUT):
                link = await open_socket(self._url, handlers, self._budget)
                try:
                    if call.hello:
                        link.send(call.hello)
                    while isinstance(found := await news.get(), bytes):
                        link.send(found)
                    return found.why
                finally:
                    link.close()
        # WebSocketException: the bridge closed the link as soon as it was open.
        except (BridgeClosed, WebSocketException) as error:
            return readable(f"no connection: {error}")
        except TimeoutError:
            return call.why_silent or f"no answer within {CALL_TIMEOUT:g} s"
