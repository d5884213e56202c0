"""Another kind of link, as *A new kind of link* in the design describes one."""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

import msgspec

from webmap.base.errors import BridgeClosed, ProtocolError, ServiceError
from webmap.ros.definitions import Definitions
from webmap.ros.received_message import BridgeStats, LinkState, ReceivedMessage
from webmap.ros.subscriptions import Topic

NO_PIGEON = "no pigeon came back"


class PigeonMessage(ReceivedMessage):
    """A message on paper, in JSON."""

    @property
    def is_binary(self) -> bool:
        return False

    def check_count(self) -> None:
        pass  # a pigeon carries little

    def _decode(self, type: type[msgspec.Struct] | None) -> Any:
        try:
            return msgspec.json.decode(self.frame, type=type or dict[str, Any])
        except msgspec.MsgspecError as error:
            raise ProtocolError(str(error)) from None


class PigeonLane:
    state: LinkState = "new"
    last_heard: float | None = None
    lag = 0.0

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        self.state = "connecting"


class PigeonGraph:
    def known(self, topic: str) -> str | None:
        return None

    async def topics(self) -> dict[str, str]:
        raise BridgeClosed(NO_PIGEON)

    async def topic_type(self, topic: str) -> str | None:
        return None

    async def service_type(self, service: str) -> str | None:
        return None

    async def nodes(
        self, kind: Literal["publishers", "subscribers"], topic: str
    ) -> list[str] | None:
        return None

    async def other_publishers(self, topic: str) -> list[str] | None:
        return None

    async def definitions(self, type: str, kind: str) -> Definitions:
        raise ServiceError(NO_PIGEON)

    async def time(self) -> float | None:
        return None

    async def set_parameter(self, name: str, value: Any, patience: float) -> Any:
        raise ServiceError(NO_PIGEON)


class PigeonLink:
    """A link that has no class in common with that of rosbridge."""

    def __init__(
        self,
        url: str,
        name: str,
        *,
        opened: Callable[[], None],
        closed: Callable[[str], None],
        received: Callable[[Topic, ReceivedMessage], bool],
        report: Callable[[Exception], None],
    ) -> None:
        self.url, self.name = url, name
        self.lane, self.graph = PigeonLane(), PigeonGraph()
        self.stats = BridgeStats()
        self.trouble: str | None = None
        self.over: str | None = None
        self._received = received
        self._topics: dict[str, Topic] = {}

    def refuse_if_over(self) -> None:
        if self.over is not None:
            raise BridgeClosed(self.over)

    def subscribe(self, topic: Topic) -> None:
        self._topics[topic.name] = topic

    def unsubscribe(self, topic: Topic) -> None:
        self._topics.pop(topic.name, None)

    def pigeon_came(self, topic: str, frame: bytes) -> None:
        """Pass on a message that a pigeon has brought."""
        self.stats.frames += 1
        if topic in self._topics:
            self._received(self._topics[topic], PigeonMessage(topic, frame))

    def published_type(self, topic: str) -> str | None:
        return None

    def publish(self, topic: str, type: str, message: Mapping[str, Any]) -> None:
        raise BridgeClosed(NO_PIGEON)

    def unadvertise(self, topic: str) -> None:
        pass

    async def call_service(
        self,
        service: str,
        args: Mapping[str, Any] | Sequence[Any] | None,
        *,
        type: str | None,
        timeout: float,
    ) -> Any:
        raise BridgeClosed(NO_PIGEON)

    async def stop(self) -> None:
        self.lane.state = "closed"
