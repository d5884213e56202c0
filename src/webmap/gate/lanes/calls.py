"""Calls of services, each on a socket of its own: one that hangs holds nothing up."""

import asyncio
import logging
from collections.abc import Callable

from websockets.exceptions import WebSocketException

from webmap.base.errors import BridgeClosed
from webmap.gate.lanes.answers import answer_to
from webmap.gate.lanes.budget import Budget
from webmap.gate.lanes.navigation import readable
from webmap.gate.lanes.sockets import Ears, open_socket

log = logging.getLogger("webmap.gate")

CALL_TIMEOUT = 2.0
"""How long a service is given to answer, in seconds, the way there included."""

Ended = Callable[[str | None], None]
"""Takes why something failed, in words, or ``None`` if it did not."""


class Calls:
    """Calls services of one bridge and looks after the calls.

    Args:
        url: The bridge's address.

    """

    def __init__(self, url: str) -> None:
        self._url = url
        self._budget = Budget()
        self._calling: set[asyncio.Task[None]] = set()

    def call(
        self, request: bytes, id: str, what: str, ended: Ended = lambda why: None
    ) -> None:
        """Call a service without waiting for its answer.

        Args:
            request: The operation that calls it.
            id: The name that the answer will bear.
            what: What is called, for people.
            ended: Is told what came of it, unless it is given up by :meth:`close`.

        """
        call = self._call(request, id, what, ended)
        task = asyncio.get_running_loop().create_task(call)
        self._calling.add(task)
        task.add_done_callback(self._calling.discard)

    async def settle(self) -> None:
        """Wait until every call is answered, or will not be."""
        if self._calling:
            await asyncio.wait(self._calling)

    def close(self) -> None:
        """Give up what is not answered yet."""
        for task in self._calling:
            task.cancel()

    async def _call(self, request: bytes, id: str, what: str, ended: Ended) -> None:
        why = await self._ask(request, id)
        if why is not None:
            log.warning("%s: %s", what, why)
        ended(why)

    async def _ask(self, request: bytes, id: str) -> str | None:
        """Call a service and return why that failed, ``None`` if it did not."""
        outcomes: asyncio.Queue[str | None] = asyncio.Queue()

        def hear(data: bytes) -> None:
            answer = answer_to(data, id)
            if answer is not None:
                outcomes.put_nowait(answer.why)

        def lost(why: str) -> None:
            reason = readable(f"no answer: connection lost: {why}")
            outcomes.put_nowait(reason)

        ears = Ears(text=hear, pong=lambda _: None, lost=lost)
        try:
            async with asyncio.timeout(CALL_TIMEOUT):
                link = await open_socket(self._url, ears, self._budget)
                try:
                    link.send(request)
                    return await outcomes.get()
                finally:
                    link.close()
        # The latter of a bridge that closes the link in the breath that opens it.
        except (BridgeClosed, WebSocketException) as error:
            return readable(f"no connection: {error}")
        except TimeoutError:
            return f"no answer within {CALL_TIMEOUT:g} s"
