"""The data between an agent and a display: what a piece of it is. No I/O.

A piece begins with one byte: what follows is a frame of rosbridge, the same compressed,
or a note of the connection itself, as JSON. Laser scans are rounded, and get fewer
beams if the agent has a limit.
"""

import math
import zlib
from collections.abc import Callable
from typing import Annotated, Any, Literal, TypeAlias, TypeVar

import msgspec

from webmap.base.errors import ProtocolError, WireError
from webmap.ros.rosbridge.cbor import decode, looks_like_cbor

T = TypeVar("T")

NOTE, FRAME, PACKED = b"\0", b"\1", b"\2"

WORTH_PACKING = 256
"""Bytes of a frame from which it is compressed, if that makes it shorter."""

MOST = 64 << 20
"""Bytes of the largest frame."""

MOST_OF_DISPLAY = 64 << 10
"""Bytes of the largest frame of a display, packed and unpacked: it subscribes, and
publishes and calls what a button does."""

FLOAT32 = 85
"""The tag of an array of little-endian floats in CBOR."""

STEPS = 1024
"""Steps of a metre to which distances are rounded: a third of the bytes is noise."""

DICTIONARY = (
    b'"covariance": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "twist": {"twist": {"linear": '
    b'{"x": 0.0, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 0.0}}, '
    b'"transforms": [{"header": {"seq": 0, "stamp": {"secs": 1, "nsecs": 0, "sec": 1, '
    b'"nanosec": 0}, "frame_id": "map"}, "child_frame_id": "base_link", "transform": '
    b'{"translation": {"x": 0.0, "y": 0.0, "z": 0.0}, "rotation": {"x": 0.0, "y": 0.0, '
    b'"z": 0.0, "w": 1.0}}}, {"op": "publish", "topic": "/odom", "msg": {"header": '
    b'{"seq": 1, "stamp": {"sec": 1, "nanosec": 1}, "frame_id": "odom"}, '
    b'"child_frame_id": "base_footprint", "pose": {"pose": {"position": {"x": 1.0, '
    b'"y": 1.0, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}, '
)
"""What small frames have in common: with it, they need a quarter less."""


class Ping(msgspec.Struct, frozen=True, tag="ping"):
    """A display asks whether the agent and its rosbridge are there."""

    number: int


class Pong(msgspec.Struct, frozen=True, tag="pong"):
    """The answer to a :class:`Ping`; it comes after all data sent before it."""

    number: int
    session: str
    """The identity of the agent's connection to its rosbridge; "" without one."""
    trouble: str = ""
    """Why there is no connection to the rosbridge."""


class Bye(msgspec.Struct, frozen=True, tag="bye"):
    """A display ends a connection."""


Note = Ping | Pong | Bye

_note = msgspec.json.Decoder(Note).decode


def pack_note(note: Note) -> bytes:
    """Return the piece with a note, as JSON."""
    return NOTE + msgspec.json.encode(note)


def pack_frame(frame: bytes | bytearray) -> bytes:
    """Return the piece with a frame, compressed if that makes it shorter."""
    if len(frame) >= WORTH_PACKING:
        packing = zlib.compressobj(1, zdict=DICTIONARY)
        packed = packing.compress(frame) + packing.flush()
        if len(packed) < 0.9 * len(frame):
            return PACKED + packed
    return FRAME + bytes(frame)


def unpack(piece: bytes, most: int = MOST) -> Note | bytes:
    """Return the note or the frame in a piece.

    Args:
        piece: The bytes.
        most: Bytes of the largest frame, packed and unpacked.

    Raises:
        WireError: If the bytes are neither.

    """
    if len(piece) > most + 1:
        raise WireError(f"got {len(piece)} bytes, expected {most} at most")
    kind, body = piece[:1], piece[1:]
    try:
        if kind == FRAME:
            return body
        if kind == PACKED:
            unpacking = zlib.decompressobj(zdict=DICTIONARY)
            frame = unpacking.decompress(body, most)
            if not unpacking.eof:
                raise WireError(f"got a frame of more than {most} bytes")
            return frame
        if kind == NOTE:
            note: Note = _note(body)
            return note
    except (zlib.error, ValueError, RecursionError) as error:
        raise WireError(f"got data that cannot be read: {error}") from error
    raise WireError(f"got data of the kind {kind!r}, expected one of 3")


_Name: TypeAlias = Annotated[str, msgspec.Meta(max_length=512)]


class SubscribeOp(msgspec.Struct, omit_defaults=True):
    """An operation of a display on a topic or a service."""

    op: str = ""
    topic: _Name = ""
    id: _Name | None = None
    type: _Name | None = None
    throttle_rate: int = 0
    queue_length: int = 1
    compression: Literal["none", "png", "cbor", "cbor-raw"] | None = None
    service: _Name = ""
    args: msgspec.Raw = msgspec.Raw(b"{}")


_op = msgspec.json.Decoder(SubscribeOp).decode


def read_json(decode: Callable[[bytes], T], text: bytes, name: str) -> T:
    """Return what a decoder makes of JSON.

    Args:
        decode: The decoder.
        text: The JSON.
        name: What the text is, for the error.

    Raises:
        WireError: If it cannot be read.

    """
    try:
        return decode(text)
    except (ValueError, RecursionError) as error:
        raise WireError(f"got {name} that cannot be read: {error}") from error


def read_op(frame: bytes) -> SubscribeOp:
    """Return an operation of a display.

    Raises:
        WireError: If it is not one of rosbridge.

    """
    return read_json(_op, frame, "an operation")


def lean_scan(frame: bytes | bytearray, beams: int | None) -> bytes | bytearray:
    """Return the frame of a ``sensor_msgs/LaserScan`` that needs fewer bytes.

    Distances in CBOR are rounded to 1/1024 m. If there are too many beams, each group
    of neighbouring beams becomes one beam in their middle, with the shortest of their
    valid distances, so that no obstacle is left out; intensities are.

    Args:
        frame: The operation ``publish``, as JSON or CBOR.
        beams: The greatest number of beams, if there is one.

    Returns:
        The new frame, of the same kind; ``frame`` itself if nothing changes.

    Raises:
        WireError: If the message is no scan.

    """
    is_cbor = looks_like_cbor(frame)
    if beams is None and not is_cbor:
        return frame
    try:
        operation = decode(frame) if is_cbor else msgspec.json.decode(frame)
        scan = operation["msg"]
        count = len(scan["ranges"])
        if beams is not None and count > beams:
            _thin(scan, math.ceil(count / beams))
        elif not is_cbor:
            return frame
        return _packed(operation, scan) if is_cbor else msgspec.json.encode(operation)
    except (ProtocolError, ValueError, LookupError, TypeError, RecursionError) as error:
        raise WireError(f"got a message that is no scan: {error!r}") from error


def _packed(operation: dict[str, Any], scan: dict[str, Any]) -> bytes:
    """Return the operation with a scan in CBOR, with rounded distances."""
    import cbor2
    import numpy as np

    for name in ("ranges", "intensities"):
        numbers = np.asarray(scan[name], dtype=float)
        if name == "ranges":
            numbers = np.round(numbers * STEPS) / STEPS
        scan[name] = cbor2.CBORTag(FLOAT32, numbers.astype("<f4").tobytes())
    packed: bytes = cbor2.dumps(operation)
    return packed


def _thin(scan: dict[str, Any], size: int) -> None:
    """Make one beam of each group of ``size`` beams."""
    least, step, first = (
        float(scan[name]) for name in ("range_min", "angle_increment", "angle_min")
    )
    ranges = _shortest(scan["ranges"], size, least)
    middle = first + (size - 1) / 2 * step
    scan |= {
        "angle_min": middle,
        "angle_max": middle + (len(ranges) - 1) * size * step,
        "angle_increment": size * step,
        "time_increment": size * float(scan.get("time_increment") or 0.0),
        "ranges": ranges.tolist(),
        "intensities": [],
    }


def _shortest(ranges: Any, size: int, least: float) -> Any:
    """Return the shortest valid distance of each group of beams; infinite without one.

    Args:
        ranges: The distances, in m; not a number or ``None`` if there is none.
        size: The number of beams in a group.
        least: The least valid distance, in m.

    """
    import numpy as np

    distances = np.asarray(ranges, dtype=float)
    distances = np.where(distances >= least, distances, np.inf)
    padded = np.full(math.ceil(len(distances) / size) * size, np.inf)
    padded[: len(distances)] = distances
    return padded.reshape(-1, size).min(axis=1)
