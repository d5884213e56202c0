"""Received messages, the state of a connection, and its counts."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import msgspec

from webmap.base.errors import ProtocolError

if TYPE_CHECKING:
    from webmap.ros.serialized.schemas import Schema

LinkState: TypeAlias = Literal["new", "connecting", "open", "closed"]


class ReceivedMessage:
    """A message on a topic, kept as bytes until :meth:`decode` is called.

    So a message that no listener needs, or that comes too often, is not decoded. Each
    kind of link has a subclass that reads its bytes.
    """

    __slots__ = ("_decoded", "frame", "size", "topic")

    def __init__(self, topic: str, frame: bytes | bytearray) -> None:
        self.topic = topic
        self.frame = frame
        """The bytes as received; only the first ones of a message that is too long."""
        self.size = len(frame)
        """The number of bytes that were sent."""
        self._decoded: dict[Any, Any] = {}

    def decode(self, type: type[msgspec.Struct] | None = None) -> Any:
        """Return the message as ``type``, or as a plain dict; each is decoded once.

        In a plain dict a number that the bridge could not encode is ``None``, and a
        typed array is an ``array.array``.

        Raises:
            ProtocolError: If the bytes are not a message, or the message has not the
                fields of ``type``.

        """
        if type in self._decoded:
            value = self._decoded[type]
            if isinstance(value, ProtocolError):
                raise value
            return value
        try:
            value = self._decoded[type] = self._decode(type)
        except ProtocolError as error:
            self._decoded[type] = error
            raise
        return value

    def is_decoded(self, type: type[msgspec.Struct] | None) -> bool:
        """Return whether a value or an error is stored for ``type``."""
        return type in self._decoded

    def prime(self, type: type[msgspec.Struct] | None, value: Any) -> None:
        """Store the value, or the error, that another process has decoded."""
        self._decoded[type] = value

    def forget(self, type: type[msgspec.Struct] | None) -> None:
        """Forget the stored value; the next :meth:`decode` decodes again."""
        self._decoded.pop(type, None)

    @property
    def arguments(self) -> tuple[str | None, ...]:
        """Further arguments with which the worker process makes the same message."""
        return ()

    @property
    def serialized(self) -> "tuple[Schema, bytes | bytearray] | None":
        """The message as ROS nodes send it, with its schema; None if it came otherwise.

        The bytes may not fit the schema.
        """
        return None

    @property
    def is_binary(self) -> bool:
        """Whether the bytes are not text."""
        raise NotImplementedError

    def check_count(self) -> None:
        """Check the number of values in the message before they are built.

        Raises:
            TooLarge: If the message has too many values.

        """
        raise NotImplementedError

    def _decode(self, type: type[msgspec.Struct] | None) -> Any:
        """Return the message as ``type``, as a plain dict, or raise ProtocolError."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.topic!r}, {len(self.frame)} bytes)"


@dataclass(slots=True)
class BridgeStats:
    """Counts of a connection since the bridge was created."""

    frames: int = 0
    bytes: int = 0
    malformed: int = 0
    """Frames that could not be read."""

    unknown: int = 0
    """Frames with operations that WebMap does not know."""

    links: int = 0
    """How often the connection was opened."""
