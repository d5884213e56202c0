"""Calls of services, each on a socket of its own: one that hangs holds nothing up."""

import asyncio
import logging

from webmap.errors import BridgeClosed
from webmap.gate.lanes import words
from webmap.gate.lanes.sockets import Ears, open_socket

log = logging.getLogger("webmap.gate")

CALL_TIMEOUT = 2.0
"""How long a service is given to answer, in seconds, the way there included."""


class Calls:
    """Calls services of one bridge and looks after the calls.

    Args:
        url: The bridge's address.

    """

    def __init__(self, url: str) -> None:
        self._url = url
        self._calling: set[asyncio.Task[None]] = set()

    def call(self, request: bytes, id: str, what: str) -> None:
        """Call a service without waiting for its answer.

        Args:
            request: The operation that calls it.
            id: The name that the answer will bear.
            what: What is called, for people.

        """
        task = asyncio.get_running_loop().create_task(self._call(request, id, what))
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

    async def _call(self, request: bytes, id: str, what: str) -> None:
        answered = asyncio.Event()

        def hear(data: bytes) -> None:
            heard = words.hear(data)
            if heard is not None and heard.id == id:
                answered.set()

        def lost(why: str) -> None:
            log.warning("%s: no answer, for the link is lost: %s", what, why)
            answered.set()

        ears = Ears(text=hear, pong=lambda _: None, lost=lost)
        try:
            async with asyncio.timeout(CALL_TIMEOUT):
                link = await open_socket(self._url, ears)
                try:
                    link.send(request)
                    await answered.wait()
                finally:
                    link.close()
        except BridgeClosed as error:
            log.error("%s failed: %s", what, error)
        except TimeoutError:
            log.warning("%s: no answer", what)
