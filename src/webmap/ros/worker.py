"""The process that decodes large frames: ``python -m webmap.ros.worker``.

It reads requests from standard input, writes answers to standard output, one after the
other, and ends when its input ends. Each request and each answer is a length of 4
bytes, little-endian, that many bytes of MessagePack, and then the data bytes that the
MessagePack announces.
"""

import importlib
import os
import signal
import struct
import sys
from array import array
from contextlib import suppress
from typing import Any, BinaryIO, get_args, get_type_hints

import msgspec

from webmap.base.errors import ProtocolError
from webmap.base.processes import return_large_pieces
from webmap.ros.arrays import Numbers
from webmap.ros.limits import check_items
from webmap.ros.received_message import ReceivedMessage

LENGTH = struct.Struct("<I")
MAX_MESSAGE = 512 << 20

BACKGROUND = 10
"""Nice value of the process: a map may come late, commands may not."""

MEMORY = 1536 << 20
"""Bytes of memory that the process may use; a message that needs more is an error."""

PIECE = 32
"""Items of a long list that are delivered at a time: a few milliseconds of work."""


class WorkRequest(msgspec.Struct, array_like=True):
    """One frame to decode, or a function to call with bytes."""

    size: int
    """Number of bytes that follow: the frame, or the function's first argument."""

    topic: str = ""
    message: str | None = None
    """``module:name`` of the :class:`ReceivedMessage` that reads the frame."""

    view: str | None = None
    """``module:name`` of a view of WebMap, or None for a plain mapping."""

    call: str | None = None
    """``module:name`` of a function of WebMap that returns bytes."""

    arguments: list[Any] = []
    """The further arguments of the function, or those of the message's class."""


class WorkResult(msgspec.Struct, array_like=True):
    """The result of a request; the bytes of each part follow, one after the other."""

    sizes: list[int] = []
    """Bytes of each part: the message, then further items of one of its lists."""

    field: str | None = None
    """The field of that list."""

    error: str | None = None
    kind: str = ""
    """The class of the error."""


def view_name(thing: Any) -> str | None:
    """Return the worker's name for a view or a function, or None if it has none.

    Only types and functions of WebMap have one: for those of a script the worker would
    have to run the script.
    """
    own = thing is not None and thing.__module__.startswith("webmap.")
    if not own or "<" in thing.__qualname__:
        return None
    return f"{thing.__module__}:{thing.__qualname__}"


def class_name(of: type[ReceivedMessage]) -> str:
    """Return the worker's name for a class of messages, of WebMap or of another link.

    The worker must be able to import the class: its module is in an installed package,
    or in a folder of ``PYTHONPATH``.
    """
    return f"{of.__module__}:{of.__qualname__}"


def answer(request: WorkRequest, data: bytes) -> tuple[WorkResult, list[bytes]]:
    """Return what a request asks for, in parts; never raises an error."""
    try:
        if request.call is not None:
            made = _named(request.call)(data, *request.arguments)
            return WorkResult([len(made)]), [made]
        message_class = _message_class(request.message)
        received = message_class(request.topic, data, *request.arguments)
        received.check_count()
        view = _named(request.view)
        message = received.decode(view)
        if hasattr(view, "digest"):
            message = message.digest()
        field, parts = _parts(message)
        return WorkResult([len(part) for part in parts], field), parts
    except MemoryError:
        return WorkResult(error="it takes too much memory to be decoded"), []
    except ProtocolError as error:
        return WorkResult(error=str(error), kind=type(error).__name__), []
    except Exception as error:  # the worker must survive any data
        return WorkResult(error=f"it cannot be decoded: {error!r}"), []


def _message_class(name: str | None) -> Any:
    try:
        return _named(name)
    except (ImportError, AttributeError) as error:
        raise ProtocolError(
            f"the process that decodes large messages cannot import the class {name} "
            f"({error}): install the package of this link, or add its folder to "
            "PYTHONPATH"
        ) from None


def _named(name: str | None) -> Any:
    if name is None:
        return None
    module, _, attribute = name.partition(":")
    return getattr(importlib.import_module(module), attribute)


def _parts(message: Any) -> tuple[str | None, list[bytes]]:
    """Return a message in MessagePack, its longest list of structs in pieces."""
    field = long_list(message)
    if field is None:
        return None, [_encode(message)]
    items = getattr(message, field)
    check_items(field, len(items))
    first = msgspec.structs.replace(message, **{field: items[:PIECE]})
    others = (items[at : at + PIECE] for at in range(PIECE, len(items), PIECE))
    return field, [_encode(first), *map(_encode, others)]


def long_list(message: Any) -> str | None:
    """Return the name of the longest list of structs, None if it is not long."""
    found, most = None, PIECE
    if isinstance(message, msgspec.Struct):
        for name in message.__struct_fields__:
            value = getattr(message, name)
            if type(value) is list and len(value) > most and item_type(message, name):
                found, most = name, len(value)
    return found


def item_type(message: Any, field: str) -> Any:
    """Return the type of the structs in a list of a message; None if there are none."""
    items = get_args(get_type_hints(type(message)).get(field))
    for each in (*items, *(get_args(items[0]) if items else ())):
        if isinstance(each, type) and issubclass(each, msgspec.Struct):
            return items[0]
    return None


def _enc_hook(value: Any) -> Any:
    if isinstance(value, Numbers):
        # As an extension, which the display reads without a copy.
        data = memoryview(value.values).cast("B")
        return msgspec.msgpack.Ext(ord(value.typecode), data)
    if isinstance(value, array):
        return msgspec.msgpack.Ext(ord(value.typecode), value.tobytes())
    raise ProtocolError(f"a message cannot hold a {type(value).__name__}")


_encode = msgspec.msgpack.Encoder(enc_hook=_enc_hook).encode


def read(stream: BinaryIO) -> tuple[WorkRequest, bytes] | None:
    """Return the next request of the stream and its bytes, or None at its end."""
    head = stream.read(LENGTH.size)
    if len(head) < LENGTH.size:
        return None
    (length,) = LENGTH.unpack(head)
    body = stream.read(length)
    if len(body) < length:
        return None
    request = msgspec.msgpack.decode(body, type=WorkRequest)
    data = stream.read(request.size)
    return (request, data) if len(data) == request.size else None


def main() -> None:
    """Answer requests until the input ends."""
    # The display handles an interrupt from the keyboard, and then ends the input.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if os.name == "posix":
        os.nice(BACKGROUND)
        _bound_memory()
    return_large_pieces()
    encode = msgspec.msgpack.Encoder().encode
    while (asked := read(sys.stdin.buffer)) is not None:
        reply, parts = answer(*asked)
        del asked
        body = encode(reply)
        sys.stdout.buffer.write(LENGTH.pack(len(body)) + body)
        for part in parts:
            sys.stdout.buffer.write(part)
        sys.stdout.buffer.flush()


def _bound_memory() -> None:
    import resource

    with suppress(OSError, ValueError):  # a lower limit is already set
        resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))


if __name__ == "__main__":
    main()
