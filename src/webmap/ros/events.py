"""What a bridge says, as values.

Nothing of a published message is decoded before somebody asks for it with
:meth:`Publish.decode`, so a frame that nobody wants, or that comes faster than
anybody wants it, costs a look at its head.
"""

from functools import lru_cache
from typing import Any

import msgspec

from webmap.errors import ProtocolError
from webmap.ros import cbor
from webmap.ros.decoding import check_depth, convert, decode_json


class Publish:
    """A message on a topic (rosbridge protocol, 3.3.3)."""

    __slots__ = ("_decoded", "_map", "frame", "in_parts", "topic")

    def __init__(self, topic: str, frame: bytes | bytearray) -> None:
        self.topic = topic
        self.frame = frame
        """The whole operation as it came, JSON or CBOR."""
        self.in_parts = False
        """Whether the bridge sent it in fragments."""
        self._decoded: dict[Any, Any] = {}
        self._map: dict[str, Any] | None = None

    def decode(self, type: type[msgspec.Struct] | None = None) -> Any:
        """Return the message as ``type``, or as a plain dict; decoded once each.

        In a plain dict JSON keeps ``None`` for what was ``null``, and CBOR's typed
        arrays are ``array.array``.

        Raises:
            ProtocolError: If the frame is not what its head promised, or the message
                has not the fields of ``type``.

        """
        if type not in self._decoded:
            try:
                self._decoded[type] = self._decode(type)
            except ProtocolError as error:
                self._decoded[type] = error
        value = self._decoded[type]
        if isinstance(value, ProtocolError):
            raise value
        return value

    def is_decoded(self, type: type[msgspec.Struct] | None) -> bool:
        """Return whether :meth:`decode` knows its answer already."""
        return type in self._decoded

    def prime(self, type: type[msgspec.Struct] | None, value: Any) -> None:
        """Take over what another process decoded, or the error that it met."""
        self._decoded[type] = value

    def forget(self, type: type[msgspec.Struct] | None) -> None:
        """Forget what :meth:`prime` took over: whoever asks next decodes anew."""
        self._decoded.pop(type, None)

    def _decode(self, type: type[msgspec.Struct] | None) -> Any:
        if cbor.looks_like_cbor(self.frame):
            if self._map is None:
                self._map = cbor.decode(self.frame)
            self._verify(self._map.get("op"), self._map.get("topic"))
            return convert(
                self._map.get("msg"), dict[str, Any] if type is None else type
            )
        frame = decode_json(self.frame, _frame_of(type))
        self._verify(frame.op, frame.topic)
        if type is None:
            check_depth(frame.msg)
        return frame.msg

    def _verify(self, op: object, topic: object) -> None:
        if op != "publish" or topic != self.topic:
            raise ProtocolError(
                f"a frame that begins as a message on {self.topic!r} "
                f"turned out to be {op!r} on {topic!r}"
            )

    def __repr__(self) -> str:
        return f"Publish({self.topic!r}, {len(self.frame)} bytes)"


@lru_cache(maxsize=256)
def _frame_of(type: type[msgspec.Struct] | None) -> Any:
    """Return the type of a whole publish operation, to be decoded in one pass."""
    message: Any = dict[str, Any] if type is None else type
    return msgspec.defstruct("Frame", [("op", str), ("topic", str), ("msg", message)])


class ServiceResponse(msgspec.Struct, frozen=True):
    """The answer to a call (3.4.2)."""

    service: str = ""
    id: str | int | float | None = None
    result: bool = True
    values: Any = None
    """The fields of the answer, or a text that says what went wrong."""


class CallService(msgspec.Struct, frozen=True):
    """The bridge asks a service of this client (3.4.1)."""

    service: str
    id: str | int | float | None = None
    args: Any = None


class Status(msgspec.Struct, frozen=True):
    """The bridge says how it is (3.2.2); Python's bridges never do."""

    level: str = "error"
    msg: Any = ""
    id: str | int | float | None = None


class Unknown(msgspec.Struct, frozen=True):
    """An operation that means nothing to a client."""

    op: str


class Malformed(msgspec.Struct, frozen=True):
    """Bytes that are not rosbridge; the link itself can still be used."""

    reason: str
    size: int
    """Bytes of the frame."""


Event = Publish | ServiceResponse | CallService | Status | Unknown | Malformed
