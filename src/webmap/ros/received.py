"""What a link hands over: messages as they came, its state, and its counts."""

from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import msgspec

from webmap.base.errors import ProtocolError

LinkState: TypeAlias = Literal["new", "connecting", "open", "closed"]


class ReceivedMessage:
    """A message on a topic, as bytes until :meth:`decode` is called.

    So a message that nobody wants, or that comes faster than anybody wants it, is not
    decoded. Each kind of link has a subclass that knows how its bytes are read.
    """

    __slots__ = ("_decoded", "frame", "topic")

    def __init__(self, topic: str, frame: bytes | bytearray) -> None:
        self.topic = topic
        self.frame = frame
        """The bytes as they came."""
        self._decoded: dict[Any, Any] = {}

    def decode(self, type: type[msgspec.Struct] | None = None) -> Any:
        """Return the message as ``type``, or as a plain dict; decoded once each.

        In a plain dict a number that the link could not carry is ``None``, and a typed
        array is an ``array.array``.

        Raises:
            ProtocolError: If the bytes are no message, or the message has not the
                fields of ``type``.

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

    @property
    def is_binary(self) -> bool:
        """Whether the bytes are not text."""
        raise NotImplementedError

    def check_count(self) -> None:
        """Refuse a message with more values than anything would be built for.

        Raises:
            TooLarge: If it holds more.

        """
        raise NotImplementedError

    def _decode(self, type: type[msgspec.Struct] | None) -> Any:
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.topic!r}, {len(self.frame)} bytes)"


@dataclass(slots=True)
class BridgeStats:
    """What came over a link, since the bridge was made."""

    frames: int = 0
    bytes: int = 0
    malformed: int = 0
    """Frames that could not be understood."""

    links: int = 0
    """How often the link was opened."""
