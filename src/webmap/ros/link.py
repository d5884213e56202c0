"""What a bridge needs of a link, the way in which it speaks to one ROS system.

*A new kind of link* in the design has the rules that no type can state.
"""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, Protocol

from webmap.ros.definitions import Definitions
from webmap.ros.received_message import BridgeStats, LinkState, ReceivedMessage
from webmap.ros.subscriptions import Topic


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
