"""Messages on a pipe: four bytes of length (little-endian), then MessagePack."""

import struct
from typing import Any

import msgspec

from webmap.errors import WireError

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

        Raises:
            WireError: If the bytes are no message; the pipe is then of no more use.

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
            messages.append(self._read(bytes(buffer[start + _length.size : end])))
            start = end
        del buffer[:start]
        return messages

    def _read(self, body: bytes) -> Any:
        try:
            return self._decode(body)
        except msgspec.DecodeError as error:
            raise WireError(f"not a message on the gate's pipe: {error}") from error
