"""What a bridge needs of a link, the way in which it speaks to one ROS system.

*A new kind of link* in the design has the rules that no type can state.
"""

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, Protocol

from webmap.base.errors import BridgeClosed
from webmap.ros.definitions import Definitions
from webmap.ros.received_message import BridgeStats, LinkState, ReceivedMessage
from webmap.ros.sockets.connection import CLOSED_HERE
from webmap.ros.subscriptions import Topic

log = logging.getLogger("webmap.ros")

PATIENCE = 5.0
"""Longest wait for the response to a call, in seconds."""


class _Lane(Protocol):
    @property
    def state(self) -> LinkState: ...
    @property
    def last_heard(self) -> float | None: ...
    @property
    def lag(self) -> float: ...
    def start(self, loop: asyncio.AbstractEventLoop) -> None: ...


class _Graph(Protocol):
    def known(self, topic: str) -> str | None: ...
    async def topics(self) -> dict[str, str]: ...
    async def topic_type(self, topic: str) -> str | None: ...
    async def service_type(self, service: str) -> str | None: ...
    async def nodes(
        self, kind: Literal["publishers", "subscribers"], topic: str
    ) -> list[str] | None: ...
    async def other_publishers(self, topic: str) -> list[str] | None: ...
    async def definitions(self, type: str, kind: str) -> Definitions: ...
    async def time(self) -> float | None: ...
    async def set_parameter(self, name: str, value: Any, patience: float) -> Any: ...


class _Link(Protocol):
    stats: BridgeStats
    trouble: str | None
    over: str | None

    @property
    def lane(self) -> _Lane: ...
    @property
    def graph(self) -> _Graph: ...
    def refuse_if_over(self) -> None: ...
    def subscribe(self, topic: Topic) -> None: ...
    def unsubscribe(self, topic: Topic) -> None: ...
    def published_type(self, topic: str) -> str | None: ...
    def publish(self, topic: str, type: str, message: Mapping[str, Any]) -> None: ...
    def unadvertise(self, topic: str) -> None: ...
    async def call_service(
        self,
        service: str,
        args: Mapping[str, Any] | Sequence[Any] | None,
        *,
        type: str | None,
        timeout: float,
    ) -> Any: ...
    async def stop(self) -> None: ...


class LinkType(Protocol):
    """The class of a kind of link; it need not derive from any other class."""

    def __call__(
        self,
        url: str,
        name: str,
        *,
        opened: Callable[[], None],
        closed: Callable[[str], None],
        received: Callable[[Topic, ReceivedMessage], bool],
        report: Callable[[Exception], None],
    ) -> _Link:
        """Make the link of one bridge, which opens no connection yet."""


class _Calls(Protocol):
    async def call(
        self,
        service: str,
        args: Mapping[str, Any] | Sequence[Any] | None,
        type: str | None,
        patience: float,
        /,
    ) -> Any: ...
    async def stop(self) -> None: ...


class ReconnectingLink:
    """The state of a link, what is logged about it, and its calls.

    Args:
        name: The bridge's name, as shown to people.
        opened: Called when the connection is open.
        closed: Called with the reason when an open connection has ended.
        report: Called with each error that a person may need to know.

    """

    _calls: _Calls

    def __init__(
        self,
        name: str,
        opened: Callable[[], None],
        closed: Callable[[str], None],
        report: Callable[[Exception], None],
    ) -> None:
        self.stats = BridgeStats()
        self.trouble: str | None = None
        """Why the connection is not open: the last failed attempt or the last loss."""
        self.over: str | None = None
        """Why no connection is opened any more; None if connections are allowed."""
        self._name = name
        self._on_open = opened
        self._on_close = closed
        self._report = report
        self._complained = False
        """Whether the failure of the connection has been logged."""

    def refuse_if_over(self) -> None:
        """Raise BridgeClosed if no connection is opened any more."""
        if self.over is not None:
            raise BridgeClosed(self.over)

    async def call_service(
        self,
        service: str,
        args: Mapping[str, Any] | Sequence[Any] | None = None,
        *,
        type: str | None = None,
        timeout: float = PATIENCE,
    ) -> Any:
        """Call a ROS service on a socket of its own; return the fields of the response.

        Raises:
            ServiceError: If the service fails or does not respond in time.
            BridgeClosed: If the connection cannot be opened, or ends before the
                response.

        """
        self.refuse_if_over()
        return await self._calls.call(service, args, type, timeout)

    def _opened(self) -> None:
        self.stats.links += 1
        self.trouble, self._complained = None, False
        log.info("%s: the connection is open", self._name)

    def _lost(self, reason: str) -> None:
        level = logging.INFO if reason == CLOSED_HERE else logging.WARNING
        log.log(level, "%s: the connection ended: %s", self._name, reason)
        self.trouble = reason

    def _not_opened(self, error: BridgeClosed) -> None:
        # Log one line for a bridge that cannot be reached, however long that lasts.
        level = logging.DEBUG if self._complained else logging.WARNING
        self._complained = True
        self.trouble = error.why
        log.log(level, "%s", error, extra={"source": self._name})
        self._report(error)
