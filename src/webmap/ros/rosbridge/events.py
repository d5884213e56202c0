"""Received operations of a bridge, as values.

Of a published message only the head is read before :meth:`Publish.decode` is called.
"""

from functools import lru_cache
from typing import Any

import msgspec

from webmap.base.errors import ProtocolError
from webmap.ros.decoding import check_depth, convert, decode_json
from webmap.ros.limits import check_count
from webmap.ros.received_message import ReceivedMessage
from webmap.ros.rosbridge import cbor


class Publish(ReceivedMessage):
    """A message on a topic (rosbridge protocol, 3.3.3)."""

    __slots__ = ("_map", "in_parts")

    def __init__(
        self, topic: str, frame: bytes | bytearray, size: int | None = None
    ) -> None:
        self.topic = topic
        self.frame = frame
        """The whole operation as received, JSON or CBOR."""
        self.size = len(frame) if size is None else size
        self.in_parts = False
        """Whether the bridge sent it in fragments."""
        self._decoded = {}
        self._map: dict[str, Any] | None = None

    @property
    def is_binary(self) -> bool:
        """Whether it came as CBOR."""
        return cbor.looks_like_cbor(self.frame)

    def check_count(self) -> None:
        """Check the number of values before any of them is built."""
        check_count(self.frame)

    def _decode(self, type: type[msgspec.Struct] | None) -> Any:
        frame = self.frame
        if not frame.startswith(b"{") and cbor.looks_like_cbor(frame):
            if self._map is None:
                self._map = cbor.decode(frame)
            self._verify(self._map.get("op"), self._map.get("topic"))
            return convert(
                self._map.get("msg"), dict[str, Any] if type is None else type
            )
        operation = decode_json(frame, _frame_of(type))
        self._verify(operation.op, operation.topic)
        if type is None:
            check_depth(operation.msg)
        return operation.msg

    def _verify(self, op: object, topic: object) -> None:
        if op != "publish" or topic != self.topic:
            raise ProtocolError(
                f"a frame that begins as a message on {self.topic!r} "
                f"is {op!r} on {topic!r}"
            )


@lru_cache(maxsize=256)
def _frame_of(type: type[msgspec.Struct] | None) -> Any:
    """Return the type of a whole publish operation, to be decoded in one pass."""
    message: Any = dict[str, Any] if type is None else type
    return msgspec.defstruct("Frame", [("op", str), ("topic", str), ("msg", message)])


class ServiceResponse(msgspec.Struct, frozen=True):
    """The response to a call (3.4.2)."""

    service: str = ""
    id: str | int | float | None = None
    result: bool = True
    values: Any = None
    """The fields of the response, or an error message."""


class CallService(msgspec.Struct, frozen=True):
    """A call of a service that this client offers (3.4.1)."""

    service: str
    id: str | int | float | None = None
    args: Any = None


class Status(msgspec.Struct, frozen=True):
    """A status message of the bridge (3.2.2); Python's bridges never send one."""

    level: str = "error"
    msg: Any = ""
    id: str | int | float | None = None


class Unknown(msgspec.Struct, frozen=True):
    """An operation without a meaning for a client."""

    op: str


class Malformed(msgspec.Struct, frozen=True):
    """Bytes that are not rosbridge; the connection can still be used."""

    reason: str
    size: int
    """Bytes of the frame."""


Event = Publish | ServiceResponse | CallService | Status | Unknown | Malformed
