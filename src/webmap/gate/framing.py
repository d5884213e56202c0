"""Messages on a pipe: four bytes of length (little-endian), then MessagePack."""

import logging
import struct
from typing import Any

import msgspec

from webmap.base.errors import WireError

log = logging.getLogger("webmap.gate")

MAX_FRAME = 1 << 20
"""The longest message that either side takes, in bytes."""

_length = struct.Struct("<I")
_encode = msgspec.msgpack.Encoder().encode


def pack(message: msgspec.Struct) -> bytes:
    """Return ``message`` as it goes down the pipe."""
    body = _encode(message)
    return _length.pack(len(body)) + body


class Unpacker:
    """Cuts the bytes of a pipe into messages.

    Args:
        type: The union of message types that may come.

    """

    def __init__(self, type: Any) -> None:
        self._decode = msgspec.msgpack.Decoder(type).decode
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[Any]:
        """Return the messages that ``data`` completes, oldest first.

        What is no message is logged and left out.

        Raises:
            WireError: If the bytes are no frames; the pipe is then of no more use.

        """
        buffer = self._buffer
        buffer += data
        messages: list[Any] = []
        start = 0
        while len(buffer) - start >= _length.size:
            (length,) = _length.unpack_from(buffer, start)
            if length > MAX_FRAME:
                raise WireError(
                    f"a message of {length} bytes on the gate's pipe "
                    f"(at most {MAX_FRAME})"
                )
            end = start + _length.size + length
            if len(buffer) < end:
                break
            self._read(bytes(buffer[start + _length.size : end]), messages)
            start = end
        del buffer[:start]
        return messages

    def _read(self, body: bytes, messages: list[Any]) -> None:
        try:
            messages.append(self._decode(body))
        except (msgspec.DecodeError, RecursionError) as error:
            log.error("not a message on the gate's pipe: %s", error)
