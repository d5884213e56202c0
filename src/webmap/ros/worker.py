"""The process that decodes large frames: ``python -m webmap.ros.worker``.

It reads requests from its standard input and writes answers to its standard output,
one after the other, and ends when its input does. Each is a length of 4 bytes,
little-endian, and that much MessagePack.
"""

import importlib
import os
import signal
import struct
import sys
from array import array
from typing import Any, BinaryIO

import msgspec

from webmap.errors import ProtocolError
from webmap.memory import return_large_pieces
from webmap.ros.arrays import Numbers
from webmap.ros.events import Publish

LENGTH = struct.Struct("<I")
MAX_MESSAGE = 512 << 20

BACKGROUND = 10
"""How nice the process is: a map may come later, what drives a robot may not."""


class Request(msgspec.Struct, array_like=True):
    """One frame, and what to make of it."""

    topic: str
    frame: bytes
    view: str | None
    """``module:name`` of a view of WebMap's own, or None for a plain mapping."""


class Answer(msgspec.Struct, array_like=True):
    """What became of it."""

    message: msgspec.Raw = msgspec.Raw(b"\xc0")
    error: str | None = None


def view_name(view: Any) -> str | None:
    """Return how a view is named to the worker, or None if it cannot be.

    Only WebMap's own are: a script's types would need the script to be run again.
    """
    own = view is not None and view.__module__.startswith("webmap.")
    if not own or "<" in view.__qualname__:
        return None
    return f"{view.__module__}:{view.__qualname__}"


def answer(request: Request) -> Answer:
    """Return the decoded message, or what is wrong with it."""
    try:
        message = Publish(request.topic, request.frame).decode(_view(request.view))
        return Answer(msgspec.Raw(_encode(message)))
    except ProtocolError as error:
        return Answer(error=str(error))
    except Exception as error:  # whatever a robot sent, the next frame is due
        return Answer(error=f"it cannot be decoded: {error!r}")


def _view(name: str | None) -> Any:
    if name is None:
        return None
    module, _, attribute = name.partition(":")
    return getattr(importlib.import_module(module), attribute)


def _enc_hook(value: Any) -> Any:
    if isinstance(value, Numbers):
        return bytes(value)
    if isinstance(value, array):
        return msgspec.msgpack.Ext(ord(value.typecode), value.tobytes())
    raise ProtocolError(f"a message cannot hold a {type(value).__name__}")


_encode = msgspec.msgpack.Encoder(enc_hook=_enc_hook).encode


def read(stream: BinaryIO) -> bytes | None:
    """Return the next message of the stream, or None at its end."""
    head = stream.read(LENGTH.size)
    if len(head) < LENGTH.size:
        return None
    (length,) = LENGTH.unpack(head)
    body = stream.read(length)
    return body if len(body) == length else None


def main() -> None:
    """Serve until the input ends."""
    # An interrupt from the keyboard is for the display, which then ends the input.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if os.name == "posix":
        os.nice(BACKGROUND)
    return_large_pieces()
    decoder = msgspec.msgpack.Decoder(Request)
    encoder = msgspec.msgpack.Encoder()
    while (body := read(sys.stdin.buffer)) is not None:
        reply = encoder.encode(answer(decoder.decode(body)))
        sys.stdout.buffer.write(LENGTH.pack(len(reply)) + reply)
        sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
