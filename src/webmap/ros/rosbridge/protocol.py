"""The client's half of the rosbridge protocol, without I/O: frames in, events out.

See Also:
    https://github.com/RobotWebTools/rosbridge_suite/blob/ros2/ROSBRIDGE_PROTOCOL.md

"""

import math
import re
from functools import lru_cache
from typing import Any

import msgspec

from webmap.base.errors import ProtocolError
from webmap.ros.decoding import check_depth, convert, decode_json
from webmap.ros.limits import LARGE, MAX_FRAME, MIB
from webmap.ros.rosbridge import cbor
from webmap.ros.rosbridge.events import (
    MAX_NUMBERS,
    MAX_OTHER,
    CallService,
    Event,
    Malformed,
    Publish,
    ServiceResponse,
    Status,
    Unknown,
    check_count,
)
from webmap.ros.sockets.frame_reader import SHORTENED, whole_of


class TextFragment(msgspec.Struct, frozen=True):
    """One piece of a longer text."""

    id: str | int | float | None
    data: str
    num: int
    total: float

    @property
    def count(self) -> int:
        """Number of pieces."""
        return math.floor(self.total)


class _Assembly:
    """The received pieces of one message."""

    def __init__(self, count: int, began: float) -> None:
        self.count = count
        self.began = began
        self.pieces: dict[int, bytes] = {}
        self.size = 0
        self.received = 0
        self.messages = 1

    def add(self, fragment: TextFragment) -> None:
        try:
            data = fragment.data.encode()
        except UnicodeEncodeError as error:
            raise ProtocolError(f"fragments that are not text: {error}") from None
        self.received += 1
        self.size += len(data)
        if fragment.num in self.pieces:
            # Another message of the same length: its pieces cannot be distinguished.
            if fragment.num == 0:
                self.messages += 1
            self.messages = max(self.messages, 2)
        self.pieces[fragment.num] = data


class Fragments:
    """The messages of one connection that came in part (rosbridge protocol, 2.2.2).

    Python's bridges give every message the same ``id`` and let the fragments of several
    topics interleave under it. Their ``total`` is the length less one, divided by the
    size of a fragment, plus one: 5.1446 for five fragments. So ``id`` and ``total``
    together identify a message; if two messages of one length interleave, both are
    dropped.

    Args:
        max_count: Most fragments of a message.
        max_bytes: Most bytes of all incomplete messages.
        max_age: Longest time from the first fragment to the last, in seconds.

    """

    MAX_OPEN = 16
    """Most incomplete messages at a time."""

    def __init__(
        self, *, max_count: int = 64, max_bytes: int = 64 << 20, max_age: float = 60.0
    ) -> None:
        self.max_count = max_count
        self.max_bytes = max_bytes
        self.max_age = max_age
        self._open: dict[tuple[object, float], _Assembly] = {}

    def __len__(self) -> int:
        return len(self._open)

    def add(self, fragment: TextFragment, now: float) -> bytes | None:
        """Add one fragment; return the whole text if this was the last.

        Raises:
            ProtocolError: If the fragment is invalid, a limit is exceeded, or two
                messages were mixed; the pieces of the message are then dropped.

        """
        for key, assembly in list(self._open.items()):
            if now - assembly.began > self.max_age:
                del self._open[key]
        self._check(fragment)
        key = (fragment.id, fragment.total)
        if key not in self._open:
            self._open[key] = _Assembly(fragment.count, now)
            if len(self._open) > self.MAX_OPEN:
                del self._open[next(iter(self._open))]
        assembly = self._open[key]
        assembly.add(fragment)
        self._bound_bytes(key)
        if assembly.received < assembly.count * assembly.messages:
            return None
        del self._open[key]
        if assembly.messages > 1:
            raise ProtocolError(
                f"{assembly.messages} messages of {assembly.count} fragments each "
                f"interleave under id {fragment.id!r}: they cannot be distinguished"
            )
        return b"".join(assembly.pieces[num] for num in range(assembly.count))

    def _check(self, fragment: TextFragment) -> None:
        if not math.isfinite(fragment.total) or fragment.count < 1:
            raise ProtocolError(f"a fragment of {fragment.total!r} fragments")
        if fragment.count > self.max_count:
            raise ProtocolError(
                f"a message in {fragment.count} fragments, at most "
                f"{self.max_count} are allowed"
            )
        if not 0 <= fragment.num < fragment.count:
            raise ProtocolError(f"fragment {fragment.num} of {fragment.count}")

    def _bound_bytes(self, key: tuple[object, float]) -> None:
        if sum(assembly.size for assembly in self._open.values()) > self.max_bytes:
            del self._open[key]
            raise ProtocolError(
                f"fragments of more than {self.max_bytes} bytes wait for their rest"
            )


# The beginning of a message on a topic from every bridge that was measured.
_JSON_HEAD = re.compile(
    rb'\s*+\{\s*+"op"\s*+:\s*+"publish"\s*+,\s*+"topic"\s*+:\s*+"([^"]{1,1200}+)"'
)
_CBOR_HEAD = re.compile(
    rb"[\xa3-\xb7]\x62op\x67publish\x65topic(?:([\x61-\x77])|\x78(.))", re.DOTALL
)


class _Op(msgspec.Struct):
    op: str


class _Topic(msgspec.Struct):
    topic: str
    msg: msgspec.Raw


class _CborTopic(msgspec.Struct):
    topic: str
    msg: Any


_PLAIN_EVENTS: dict[str, Any] = {
    "service_response": ServiceResponse,
    "call_service": CallService,
    "status": Status,
}


class Protocol:
    """The reading side of one connection; a new connection needs a new one.

    Args:
        fragments: Limits of messages that come in parts.

    """

    def __init__(self, fragments: Fragments | None = None) -> None:
        self._fragments = Fragments() if fragments is None else fragments

    def receive(self, frame: bytes | bytearray | str, now: float) -> Event | None:
        """Return the event in ``frame``, or None if it is a part of a message.

        Args:
            frame: One WebSocket message, text or binary; its first byte shows the
                encoding.
            now: Seconds of a monotonic clock, to drop old parts.

        Returns:
            :class:`~webmap.ros.rosbridge.events.Malformed` for bytes that are not
            rosbridge. The message of a :class:`~webmap.ros.rosbridge.events.Publish`
            may still fail to decode.

        """
        if isinstance(frame, str):
            frame = frame.encode(errors="replace")
        if len(frame) <= MAX_FRAME and (topic := topic_in_head(frame)) is not None:
            return Publish(topic, frame)
        try:
            return self._read(frame, now, nested=False)
        except ProtocolError as error:
            return Malformed(str(error), len(frame))

    def _read(
        self, frame: bytes | bytearray, now: float, *, nested: bool
    ) -> Event | None:
        size = len(frame)
        if frame.startswith(SHORTENED):
            size, frame = whole_of(frame)
            if (topic := topic_in_head(frame)) is not None:
                return Publish(topic, frame, size)
        if size > MAX_FRAME:
            raise ProtocolError(f"a frame of {size} bytes, at most {MAX_FRAME}")
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
        if op == "fragment":
            return self._join(decode_json(frame, TextFragment), now, nested=nested)
        return Unknown(op[:64])

    def _join(
        self, fragment: TextFragment, now: float, *, nested: bool
    ) -> Event | None:
        if nested:
            raise ProtocolError("a fragment within another wrapping")
        text = self._fragments.add(fragment, now)
        if text is None:
            return None
        event = self._read(text, now, nested=True)
        if isinstance(event, Publish):
            event.in_parts = True
        return event


def _check_other(frame: bytes | bytearray) -> None:
    """Check a large frame that is decoded in this process and not by the worker."""
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
            "is not JSON, it may have more"
        )


def topic_in_head(frame: bytes | bytearray) -> str | None:
    """Return the topic of a publish operation, from the frame's first bytes.

    None if that is not enough; :meth:`~webmap.ros.rosbridge.events.Publish.decode`
    verifies the topic.
    """
    match = _JSON_HEAD.match(frame)
    if match is not None:
        return _topic_of(match[1])
    match = _CBOR_HEAD.match(frame)
    if match is None:
        return None
    length = match[1][0] - 0x60 if match[1] else match[2][0]
    name = frame[match.end() : match.end() + length]
    return _text(name) if len(name) == length else None


@lru_cache(maxsize=1024)
def _topic_of(name: bytes) -> str | None:
    """Return the topic from its text in JSON; None if that has other escapes."""
    name = name.replace(rb"\/", b"/")  # some bridges escape every slash
    return None if b"\\" in name else _text(name)


def _text(name: bytes | bytearray) -> str | None:
    try:
        return name.decode()
    except UnicodeDecodeError:
        return None


def _flat(event: ServiceResponse | CallService | Status) -> Event:
    """Return an event after a check of the depth of its free part."""
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
