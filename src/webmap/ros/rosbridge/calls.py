"""Calls of ROS services, on a connection of their own.

A rosbridge may handle the operations of one socket in order, so a slow service delays
all operations sent after it. Therefore calls share no socket with data, and a socket on
which a call was not answered in time gets no further calls.
"""

import asyncio
import time
from collections.abc import Mapping, Sequence
from typing import Any

from webmap.base.errors import BridgeClosed, ServiceError
from webmap.base.identifiers import generate_id
from webmap.ros.rosbridge import ops
from webmap.ros.rosbridge.events import Malformed, ServiceResponse, Status
from webmap.ros.rosbridge.protocol import Protocol
from webmap.ros.sockets.connection import BridgeConnection


class Calls:
    """The calls to one bridge; the first call opens the socket."""

    def __init__(
        self, url: str, lane_type: type[BridgeConnection] = BridgeConnection
    ) -> None:
        self.url = url
        self._lane_type = lane_type
        self._lane: _CallsLane | None = None
        self._retired: set[_CallsLane] = set()

    async def call(
        self,
        service: str,
        args: Mapping[str, Any] | Sequence[Any] | None,
        type: str | None,
        patience: float,
    ) -> Any:
        """Call ``service`` and return the fields of its response.

        Raises:
            ServiceError: If it fails, or does not respond within ``patience`` seconds.
            BridgeClosed: If the connection cannot be opened, or ends before the
                response.
            ValueError: If a number in ``args`` is NaN or infinite.
            TypeError: If a value in ``args`` has no form in JSON.

        """
        id = generate_id()
        # A bridge may give up sooner, and report as failed what is still being done.
        frame = ops.call_service(service, args, id=id, type=type, timeout=patience)
        if self._lane is None or self._lane.is_over:
            self._lane = _CallsLane(self.url, self._lane_type)
        lane = self._lane
        try:
            async with asyncio.timeout(patience):
                answer = await lane.ask(id, frame)
        except TimeoutError:
            self._retire(lane)
            raise ServiceError(lane.why_unanswered(service, patience)) from None
        if not answer.result:
            raise ServiceError(f"{service} failed: {answer.values}")
        return answer.values

    def _retire(self, lane: "_CallsLane") -> None:
        """Send no more calls on ``lane``; earlier calls on it may still be answered."""
        if self._lane is lane:
            self._lane = None
        self._retired = {each for each in self._retired if not each.is_over}
        self._retired.add(lane)
        lane.end_when_idle()

    async def stop(self) -> None:
        """Close every socket; open calls fail."""
        lanes = [*self._retired, *([self._lane] if self._lane else [])]
        self._lane, self._retired = None, set()
        await asyncio.gather(*(lane.stop() for lane in lanes))


class _CallsLane:
    def __init__(self, url: str, lane_type: type[BridgeConnection]) -> None:
        self._protocol = Protocol()
        self._waiting: dict[str, asyncio.Future[ServiceResponse]] = {}
        self._unsent: dict[str, bytes] | None = {}
        """The frames that wait for the connection; None when it has opened."""
        self._failure: Exception | None = None
        """Why it has not opened."""
        self._retired = False
        self._ending: asyncio.Task[None] | None = None
        self._unreadable: str | None = None
        """The error of the newest frame that could not be read."""
        self._lane = lane_type(
            url,
            opened=self._opened,
            received=self._received,
            closed=lambda reason: self._over(BridgeClosed(f"{url}: {reason}")),
            failed=self._over,
            again=False,
        )
        self._lane.start(asyncio.get_running_loop())

    @property
    def is_over(self) -> bool:
        return self._lane.state == "closed"

    def why_unanswered(self, service: str, patience: float) -> str:
        """Return a sentence on why a call got no response."""
        if self._unreadable is None:
            return f"{service} did not answer within {patience:g} s"
        return (
            f"{service}: no readable answer within {patience:g} s; the bridge sent "
            f"data that is not rosbridge: {self._unreadable}"
        )

    async def ask(self, id: str, frame: bytes) -> ServiceResponse:
        if self._failure is not None:
            raise self._failure
        answer: asyncio.Future[ServiceResponse] = asyncio.Future()
        self._waiting[id] = answer
        try:
            if self._unsent is None:
                self._lane.send(frame)
            else:  # thousands may wait: one future for all would search all for each
                self._unsent[id] = frame
            return await answer
        finally:
            del self._waiting[id]
            if self._unsent is not None:
                self._unsent.pop(id, None)
            self._end_if_idle()

    def end_when_idle(self) -> None:
        self._retired = True
        self._end_if_idle()

    def _end_if_idle(self) -> None:
        if self._retired and not self._waiting and self._ending is None:
            self._ending = asyncio.ensure_future(self._lane.stop())

    async def stop(self) -> None:
        await self._lane.stop()

    def _opened(self) -> None:
        waiting, self._unsent = self._unsent or {}, None
        for frame in waiting.values():
            self._lane.send(frame)

    def _over(self, error: Exception) -> None:
        if self._unsent is not None:
            self._failure = error
        for answer in self._waiting.values():
            if not answer.done():
                answer.set_exception(error)

    def _received(self, frame: bytes | bytearray) -> None:
        event = self._protocol.receive(frame, time.monotonic())
        if isinstance(event, Malformed):
            self._unreadable = event.reason[:200]
        if not isinstance(event, ServiceResponse | Status):
            return
        answer = self._waiting.get(str(event.id))
        if answer is None or answer.done():
            return
        if isinstance(event, ServiceResponse):
            answer.set_result(event)
        elif event.level == "error":
            answer.set_exception(
                ServiceError(f"the bridge reports an error: {event.msg}")
            )
