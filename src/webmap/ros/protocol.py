"""The client's half of the rosbridge protocol, without I/O: frames in, events out.

See Also:
    https://github.com/RobotWebTools/rosbridge_suite/blob/ros2/ROSBRIDGE_PROTOCOL.md

"""

import re
from typing import Any

import msgspec

from webmap.errors import ProtocolError
from webmap.ros import cbor, png
from webmap.ros.decoding import check_depth, convert, decode_json
from webmap.ros.events import (
    CallService,
    Event,
    Malformed,
    Publish,
    ServiceResponse,
    Status,
    Unknown,
)
from webmap.ros.fragments import Fragment, Fragments
from webmap.ros.limits import (
    LARGE,
    MAX_FRAME,
    MAX_NUMBERS,
    MAX_OTHER,
    MIB,
    check_count,
)

# How every bridge measured begins a message on a topic.
_JSON_HEAD = re.compile(
    rb'\s*\{\s*"op"\s*:\s*"publish"\s*,\s*"topic"\s*:\s*"((?:[^"\\]|\\/){1,600})"'
)
_CBOR_HEAD = re.compile(
    rb"[\xa3-\xb7]\x62op\x67publish\x65topic(?:([\x61-\x77])|\x78(.))", re.DOTALL
)


class _Op(msgspec.Struct):
    op: str


class _Topic(msgspec.Struct):
    topic: str
    msg: msgspec.Raw


class _Png(msgspec.Struct):
    data: str


class _CborTopic(msgspec.Struct):
    topic: str
    msg: Any


_PLAIN_EVENTS: dict[str, Any] = {
    "service_response": ServiceResponse,
    "call_service": CallService,
    "status": Status,
}


class Protocol:
    """One link's reading side; a new link needs a new one.

    Args:
        fragments: Bounds on messages that come in parts.

    """

    def __init__(self, fragments: Fragments | None = None) -> None:
        self._fragments = Fragments() if fragments is None else fragments

    def receive(self, frame: bytes | bytearray | str, now: float) -> Event | None:
        """Return what ``frame`` says, or None if it is a part of something.

        Args:
            frame: One WebSocket message, text or binary; which of them it is
                does not matter, its first byte tells.
            now: Seconds of a monotonic clock, to give up on parts.

        Returns:
            :class:`~webmap.ros.events.Malformed` for bytes that are not
            rosbridge. A :class:`~webmap.ros.events.Publish` may still turn out to
            be malformed when its message is decoded.

        """
        if isinstance(frame, str):
            frame = frame.encode(errors="replace")
        try:
            return self._read(frame, now, nested=False)
        except ProtocolError as error:
            return Malformed(str(error), len(frame))

    def _read(
        self, frame: bytes | bytearray, now: float, *, nested: bool
    ) -> Event | None:
        if len(frame) > MAX_FRAME:
            raise ProtocolError(f"a frame of {len(frame)} bytes, at most {MAX_FRAME}")
        topic = topic_in_head(frame)
        if topic is not None:
            return Publish(topic, frame)
        if len(frame) > LARGE:
            _check_other(frame)
        if cbor.looks_like_cbor(frame):
            return _read_map(frame)
        op = decode_json(frame, _Op).op
        if op == "publish":
            return Publish(decode_json(frame, _Topic).topic, frame)
        if op in _PLAIN_EVENTS:
            return _flat(decode_json(frame, _PLAIN_EVENTS[op]))
        if op in ("fragment", "png"):
            return self._unwrap(op, frame, now, nested=nested)
        return Unknown(op[:64])

    def _unwrap(
        self, op: str, frame: bytes | bytearray, now: float, *, nested: bool
    ) -> Event | None:
        if op == "png":
            inner = png.decode(decode_json(frame, _Png).data)
            return self._read_inner(inner, now)
        if nested:
            raise ProtocolError("a fragment within another wrapping")
        text = self._fragments.add(decode_json(frame, Fragment), now)
        if text is None:
            return None
        event = self._read(text, now, nested=True)
        if isinstance(event, Publish):
            event.in_parts = True
        return event

    def _read_inner(self, frame: bytes | bytearray, now: float) -> Event | None:
        if topic_in_head(frame) is None and decode_json(frame, _Op).op in (
            "fragment",
            "png",
        ):
            raise ProtocolError("a PNG that holds another wrapping")
        return self._read(frame, now, nested=True)


def _check_other(frame: bytes | bytearray) -> None:
    """Let a large frame pass that is decoded here and now, and not by the worker."""
    if len(frame) > MAX_OTHER:
        raise ProtocolError(
            f"a frame of {len(frame) / MIB:.1f} MiB that does not begin as a message "
            f'on a topic ({{"op":"publish","topic":...); others have '
            f"{MAX_OTHER // MIB} MiB at most"
        )
    check_count(frame)
    if b"NaN" in frame and frame.count(b",") > MAX_NUMBERS:
        raise ProtocolError(
            f"a frame with NaN and more than {MAX_NUMBERS} values; without NaN, which "
            "is no JSON, it may have more"
        )


def topic_in_head(frame: bytes | bytearray) -> str | None:
    """Return the topic of a publish operation, told from the frame's first bytes.

    None where a closer look is needed. :meth:`~webmap.ros.events.Publish.decode`
    verifies it.
    """
    match = _JSON_HEAD.match(frame)
    if match is not None:
        return _text(match[1].replace(rb"\/", b"/"))
    match = _CBOR_HEAD.match(frame)
    if match is None:
        return None
    length = match[1][0] - 0x60 if match[1] else match[2][0]
    name = frame[match.end() : match.end() + length]
    return _text(name) if len(name) == length else None


def _text(name: bytes | bytearray) -> str | None:
    try:
        return name.decode()
    except UnicodeDecodeError:
        return None


def _flat(event: ServiceResponse | CallService | Status) -> Event:
    """Return an event whose free part is not nested too deeply."""
    for name in ("values", "args", "msg"):
        check_depth(getattr(event, name, None))
    return event


def _read_map(frame: bytes | bytearray) -> Event:
    value = cbor.decode(frame)
    op = value.get("op")
    if not isinstance(op, str):
        raise ProtocolError(f"an operation named {op!r}")
    if op == "publish":
        return Publish(convert(value, _CborTopic).topic, frame)
    if op in _PLAIN_EVENTS:
        event: Event = convert(value, _PLAIN_EVENTS[op])
        return event
    return Unknown(op[:64])
