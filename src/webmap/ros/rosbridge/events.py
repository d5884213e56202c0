"""Received operations of a bridge, as values, and the limits of their frames.

Of a published message only the head is read before :meth:`Publish.decode` is called.
"""

import re
from functools import lru_cache
from typing import Any

import msgspec

from webmap.base.errors import ProtocolError
from webmap.ros.decoding import check_depth, convert, decode_json
from webmap.ros.limits import GENERAL, MAX_VALUES, MIB, TooLarge
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


MAX_OTHER = 4 * MIB
"""Most bytes of a frame that is not plainly a message on a topic."""

MAX_NUMBERS = 200_000
"""Most values of such a frame if it has NaN and only the slow decoder can read it."""

MAX_ITEMS = 1_000_000
"""Most data items in one message in CBOR, where an array of numbers is one item."""


def check_count(frame: bytes | bytearray) -> None:
    """Check the number of values in a frame.

    Args:
        frame: A whole frame, JSON or CBOR. Any other frame passes; the decoder reports
            it.

    Raises:
        TooLarge: If there are more than :data:`MAX_VALUES` objects and lists, or more
            than :data:`MAX_ITEMS` items of CBOR.

    """
    if frame[:1] and 0xA0 <= frame[0] <= 0xBF:
        _count_cbor(frame)
    elif (
        _brackets(frame) > MAX_VALUES
        # Strings may contain brackets, too.
        and (count := _brackets(_TEXT.sub(b"", frame))) > MAX_VALUES
    ):
        raise _too_many(count, MAX_VALUES)


# Possessive: no backtracking.
_TEXT = re.compile(rb'"(?:[^"\\]++|\\.)*+"', re.DOTALL)


def _brackets(text: bytes | bytearray) -> int:
    return text.count(b"{") + text.count(b"[")


def _too_many(count: int, most: int) -> TooLarge:
    what = "objects and lists" if most == MAX_VALUES else "items of CBOR"
    return TooLarge(
        f"got a message with {count} or more {what}; the limit is {most}: "
        f"{GENERAL.advice}"
    )


def _count_cbor(frame: bytes | bytearray) -> None:
    """Walk from the head of one item to the next, as in RFC 8949, section 3."""
    at = items = values = 0
    end = len(frame)
    while at < end:
        kind, info = frame[at] >> 5, frame[at] & 31
        at += 1
        length = info
        if 24 <= info <= 27:
            size = 1 << (info - 24)
            length = int.from_bytes(frame[at : at + size], "big")
            at += size
        if kind in (2, 3) and info != 31:
            at += length
        items += 1
        values += kind in (4, 5)
        if values > MAX_VALUES:
            raise _too_many(values, MAX_VALUES)
        if items > MAX_ITEMS:
            raise _too_many(items, MAX_ITEMS)
