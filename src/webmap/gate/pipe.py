"""The pipe between the display and the gate: its frames, and the gate's queues.

A display that does not read, or a terminal that was stopped with Ctrl-S, must not block
the process that stops robots. So threads do the writing.
"""

import contextlib
import logging
import os
import queue
import struct
import threading
from typing import Any

import msgspec

from webmap.base.errors import WireError
from webmap.gate.protocol import FromGate, SentTwist, Tick

log = logging.getLogger("webmap.gate")

MAX_FRAME = 1 << 20
"""The longest message that either side accepts, in bytes."""

_length = struct.Struct("<I")
_encode = msgspec.msgpack.Encoder().encode


def pack(message: msgspec.Struct) -> bytes:
    """Return a message in MessagePack, after four bytes with its length."""
    body = _encode(message)
    return _length.pack(len(body)) + body


class Unpacker:
    """Splits the bytes of a pipe into messages.

    Args:
        type: The union of message types that may come.

    """

    def __init__(self, type: Any) -> None:
        self._decode = msgspec.msgpack.Decoder(type).decode
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[Any]:
        """Return the messages that ``data`` completes, oldest first.

        A frame that cannot be decoded is logged and left out.

        Raises:
            WireError: If the bytes are not frames; the pipe is then unusable.

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
        except (ValueError, RecursionError) as error:
            log.error("not a message on the gate's pipe: %s", error)


FULL = 1000
"""With more messages than this waiting, those that newer ones replace are dropped."""

OVERFULL = 20_000
"""With more messages than this waiting, every new one is dropped."""


class PipeWriter:
    """Writes messages to a pipe in a thread of its own.

    Args:
        file: The descriptor of the pipe.

    """

    def __init__(self, file: int) -> None:
        self._file = file
        self._queue: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._thread = threading.Thread(
            target=self._write, name="gate-outbox", daemon=True
        )
        self._thread.start()

    def put(self, message: FromGate) -> None:
        """Queue a message; of a full queue, those that newer ones replace are lost.

        A report is repeated only when it changes, so none is lost.
        """
        waiting = self._queue.qsize()
        if waiting > OVERFULL:
            return
        if waiting > FULL and isinstance(message, Tick | SentTwist):
            return
        self._queue.put(pack(message))

    def close(self, timeout: float) -> None:
        """Write the waiting messages, for ``timeout`` seconds at most."""
        self._queue.put(None)
        self._thread.join(timeout)

    def _write(self) -> None:
        with contextlib.suppress(OSError):  # the display has closed the pipe
            frames: list[bytes | None] = [b""]
            while frames[-1] is not None:
                frames = [self._queue.get()]
                frames += [self._queue.get() for _ in range(self._queue.qsize())]
                data = memoryview(b"".join(filter(None, frames)))
                while data:
                    data = data[os.write(self._file, data) :]


class BackgroundHandler(logging.Handler):
    """Passes records to another handler in a thread; drops them if its queue is full.

    Args:
        handler: Writes the records.

    """

    def __init__(self, handler: logging.Handler) -> None:
        super().__init__()
        self._handler = handler
        self._records: queue.Queue[logging.LogRecord | None] = queue.Queue(FULL)
        self._thread = threading.Thread(target=self._work, name="gate-log", daemon=True)
        self._thread.start()

    def emit(self, record: logging.LogRecord) -> None:
        """Queue a record; it is lost if the queue is full."""
        with contextlib.suppress(queue.Full):
            self._records.put_nowait(record)

    def drain(self, timeout: float) -> None:
        """Write the waiting records, for ``timeout`` seconds at most."""
        with contextlib.suppress(queue.Full):
            self._records.put_nowait(None)
        self._thread.join(timeout)

    def _work(self) -> None:
        while (record := self._records.get()) is not None:
            self._handler.handle(record)
