"""A connection that speaks rosbridge to WebMap and reaches a Foxglove bridge.

An agent passes the operations of displays on as they are, which are those of rosbridge.
This connection carries them out with a :class:`~webmap.ros.bridge.Bridge`, so that the
robot of an agent may have a Foxglove bridge.
"""

import asyncio
from collections.abc import Coroutine
from typing import Any

import msgspec

from webmap.base.errors import BridgeClosed, ServiceError, WebMapError
from webmap.base.scope import no_scope
from webmap.ros.rosbridge.server.encode import to_cbor, to_json
from webmap.ros.sockets.connection import CLOSED_HERE, BridgeConnection
from webmap.ros.subscriptions import Subscription
from webmap.ros.temporary_bridge import TemporaryBridge


class _Operation(msgspec.Struct):
    op: str
    topic: str = ""
    id: str | None = None
    type: str | None = None
    throttle_rate: int = 0
    queue_length: int = 1
    compression: str | None = None
    msg: dict[str, Any] = {}
    service: str = ""
    args: Any = None
    timeout: float = 30.0


class RosbridgeOfFoxglove(BridgeConnection):
    """Carries out operations of rosbridge at a Foxglove bridge.

    Args:
        url: The bridge's address, ``foxglove://host:port``.
        options: The other arguments of ``BridgeConnection``.

    """

    def __init__(self, url: str, **options: Any) -> None:
        super().__init__(url, **options)
        self._bridge = TemporaryBridge(url)
        self._subscribed: dict[tuple[str, str | None], Subscription] = {}
        self._types: dict[str, str | None] = {}
        """The types of advertised topics."""
        self._tasks: set[asyncio.Task[None]] = set()
        with no_scope():
            self._bridge.on_open(self._bridge_opened)
            self._bridge.on_close(self._bridge_closed)
            self._bridge.on_error(self._bridge_failed)

    @property
    def last_heard(self) -> float | None:
        """When the last bytes came from the bridge, on the monotonic clock."""
        return self._bridge.last_heard

    @property
    def lag(self) -> float:
        """Approximate delay of the data that now comes, in seconds."""
        return self._bridge.lag

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to connect."""
        if self.state in ("new", "closed"):
            self.state = "connecting"
            self._bridge.start(loop)

    async def stop(self) -> None:
        """Close the connections and do not reopen them."""
        for task in list(self._tasks):
            task.cancel()
        self._end_subscriptions()
        await self._bridge.stop()
        if self.state == "open":
            self._closed(CLOSED_HERE)
        self.state = "closed"

    def _send(self, frame: bytes) -> None:
        asked = msgspec.json.decode(frame, type=_Operation)
        try:
            self._do(asked)
        except (WebMapError, ValueError, TypeError) as error:
            self._give({"op": "status", "level": "error", "msg": str(error)})

    def _do(self, asked: _Operation) -> None:
        match asked.op:
            case "subscribe":
                self._subscribe(asked)
            case "unsubscribe":
                ended = self._subscribed.pop((asked.topic, asked.id), None)
                if ended is not None:
                    ended.remove()
            case "publish":
                type = self._types.get(asked.topic)
                self._bridge.publish(asked.topic, asked.msg, type)
            case "advertise":
                self._types[asked.topic] = asked.type
            case "unadvertise":
                self._types.pop(asked.topic, None)
                self._bridge.unadvertise(asked.topic)
            case "call_service":
                self._spawn(self._call(asked))

    def _subscribe(self, asked: _Operation) -> None:
        as_cbor = asked.compression == "cbor"

        def deliver(message: dict[str, Any]) -> None:
            fields = {"op": "publish", "topic": asked.topic, "msg": message}
            self._deliver(to_cbor(fields) if as_cbor else to_json(fields))

        before = self._subscribed.pop((asked.topic, asked.id), None)
        with no_scope():
            self._subscribed[asked.topic, asked.id] = self._bridge.subscribe(
                asked.topic,
                deliver,
                asked.type,
                throttle=asked.throttle_rate,
                queue_length=asked.queue_length,
            )
        if before is not None:
            before.remove()

    async def _call(self, asked: _Operation) -> None:
        answer = {"op": "service_response", "service": asked.service, "id": asked.id}
        try:
            values: Any = await self._answer(asked)
            result = True
        except (WebMapError, ValueError, TypeError) as error:
            values, result = str(error), False
        self._give({**answer, "values": values, "result": result})

    async def _answer(self, asked: _Operation) -> Any:
        """Return the response of a service; of rosapi as rosapi would respond."""
        bridge = self._bridge
        about = asked.args if isinstance(asked.args, dict) else {}
        topic = str(about.get("topic", ""))
        match asked.service.removeprefix("/rosapi/"):
            case "topics":
                found = await bridge.topics()
                return {"topics": list(found), "types": list(found.values())}
            case "topic_type":
                return {"type": await bridge.topic_type(topic) or ""}
            case "service_type":
                name = str(about.get("service", ""))
                return {"type": await bridge.service_type(name) or ""}
            case "publishers" | "subscribers" as kind:
                nodes = await getattr(bridge, kind)(topic)
                if nodes is None:
                    raise ServiceError(f"the bridge names no {kind} of {topic}")
                return {kind: nodes}
            case "get_time":
                now = await bridge.time()
                if now is None:
                    raise ServiceError("no message of the bridge came yet")
                secs, rest = divmod(now, 1.0)
                return {"time": {"secs": int(secs), "nsecs": int(rest * 1e9)}}
        return await bridge.call_service(
            asked.service, asked.args, type=asked.type, timeout=asked.timeout
        )

    def _bridge_opened(self) -> None:
        self.state = "open"
        self._opened()

    def _bridge_closed(self, reason: str) -> None:
        if self.state != "open":
            return
        self._end_subscriptions()
        self._end_unless_again()
        self._closed(reason)

    def _bridge_failed(self, error: Exception) -> None:
        if self.state == "open":
            self._give({"op": "status", "level": "error", "msg": str(error)})
            return
        if isinstance(error, BridgeClosed):
            self._end_unless_again()
            self._failed(error)

    def _end_unless_again(self) -> None:
        self.state = "connecting" if self._again else "closed"
        if not self._again:
            self._spawn(self._bridge.stop())

    def _end_subscriptions(self) -> None:
        for subscription in self._subscribed.values():
            subscription.remove()
        self._subscribed.clear()

    def _spawn(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _give(self, operation: dict[str, Any]) -> None:
        self._deliver(to_json(operation))

    def _deliver(self, frame: bytes | bytearray) -> None:
        if self.state == "open":
            self._received(frame)
