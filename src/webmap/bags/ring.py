"""The last minutes of all robots in a bounded ring of files.

A ring is a folder of segments, half a minute each; the oldest is deleted when a new one
begins. A segment is a row of frames, and a frame has the records of one robot of about
a second. A frame that was cut off, because the computer went down, ends its segment.
"""

import contextlib
import os
import shutil
import struct
import time
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from io import FileIO
from pathlib import Path
from typing import Literal, TypeAlias

import msgspec

MINUTES = 10
"""Minutes that a ring has at least."""

SEGMENT = 30.0
"""Seconds of a segment."""

SEGMENTS = MINUTES * 60 // int(SEGMENT) + 1
"""The number of segments; the newest one is not complete."""

PER_ROBOT = 4 << 20
"""Most bytes of one robot in a ring."""

TOTAL = 128 << 20
"""Most bytes of a ring."""

SPARE = 64 << 20
"""Bytes that a ring leaves free on its disk, for the files of an active STOP."""

BUSY = 3
"""Exit status of a process that was to make a recording, if another one does."""

LARGEST = 4 << 20
"""Most bytes of a frame that is read."""

_HEAD = struct.Struct("<II")

Kind: TypeAlias = Literal["stop", "alarm", "goal", "result", "note"]
Velocity: TypeAlias = tuple[float, float, float, float, float, float]
"""x, y, turn, z, rx, ry, as in the reports of the gate."""
Place: TypeAlias = tuple[float, float, float, float, float, float, float]
"""A position in metres and an orientation: x, y, z, qx, qy, qz, qw."""


class PoseRecord(msgspec.Struct, array_like=True, tag="p", frozen=True):
    """Where a robot was on the common map, and its velocity by odometry."""

    time: int
    """When it was recorded, in nanoseconds since 1970."""
    stamp: int
    """When it was measured."""
    place: Place
    measured: Velocity | None


class VelocityRecord(msgspec.Struct, array_like=True, tag="v", frozen=True):
    """The velocities in a report of the gate: sent, sent back, measured."""

    time: int
    sent: Velocity
    echoed: Velocity | None
    measured: Velocity | None


class ScanRecord(msgspec.Struct, array_like=True, tag="s", frozen=True):
    """A scan, with fewer rays."""

    time: int
    stamp: int
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: bytes
    """Metres, as 32-bit floats."""
    mount: Place
    """Where the sensor is on the robot."""


class EventRecord(msgspec.Struct, array_like=True, tag="e", frozen=True):
    """What happened, in words."""

    time: int
    kind: Kind
    text: str


Record: TypeAlias = PoseRecord | VelocityRecord | ScanRecord | EventRecord


class Frame(msgspec.Struct, array_like=True, frozen=True):
    """Some records of one robot."""

    robot: str
    """The identifier of the robot."""
    name: str
    records: list[Record]


_encoder = msgspec.msgpack.Encoder()
_decoder = msgspec.msgpack.Decoder(Frame)


def encode(frame: Frame) -> bytes:
    """Return a frame with its length and its check sum."""
    data = _encoder.encode(frame)
    return _HEAD.pack(len(data), zlib.crc32(data)) + data


def frames_in(data: bytes) -> Iterator[Frame]:
    """Yield the frames of a segment, up to the first that is not complete."""
    at = 0
    while at + _HEAD.size <= len(data):
        length, check = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        part = data[at : at + length]
        if length > LARGEST or len(part) < length or zlib.crc32(part) != check:
            return
        try:
            yield _decoder.decode(part)
        except msgspec.DecodeError:
            return
        at += length


class Ring:
    """Writes a ring; not thread-safe.

    Args:
        folder: The folder of the segments; created if missing.
        per_robot: Most bytes of one robot in the ring.
        total: Most bytes of the ring.
        spare: Bytes to leave free on the disk.

    """

    def __init__(
        self,
        folder: Path,
        *,
        per_robot: int = PER_ROBOT,
        total: int = TOTAL,
        spare: int = SPARE,
    ) -> None:
        self._folder = folder
        self._share = per_robot // SEGMENTS
        self._most = total // SEGMENTS
        self._spare = spare
        self._file: FileIO | None = None
        self._until = 0.0
        self._size = 0
        self._sizes: Counter[str] = Counter()

    def write(self, frames: Sequence[Frame], now: float) -> None:
        """Append frames; of a robot above its share only the events.

        Args:
            frames: The frames of about a second.
            now: Seconds of a monotonic clock.

        Raises:
            OSError: If the disk does not accept them, or is nearly full.

        """
        if self._file is None or now >= self._until:
            self._begin(now)
        data = b"".join(filter(None, map(self._fitting, frames)))
        if data and self._file is not None and self._file.write(data) != len(data):
            self.close()  # the rest would follow a part of a frame
            raise OSError(28, "no space left on the disk")

    def freeze(self, into: Path) -> None:
        """Link all segments into a new folder, where they stay until it is deleted.

        Raises:
            OSError: If that fails.

        """
        self.close()
        into.mkdir(mode=0o700)
        for segment in segments(self._folder):
            try:
                os.link(segment, into / segment.name)
            except OSError:  # not every disk has links
                shutil.copyfile(segment, into / segment.name)

    def close(self) -> None:
        """Close the newest segment; the next :meth:`write` begins another."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _fitting(self, frame: Frame) -> bytes:
        data = encode(frame)
        if self._sizes[frame.robot] + len(data) > self._share or (
            self._size + len(data) > self._most
        ):
            events = [each for each in frame.records if isinstance(each, EventRecord)]
            data = encode(msgspec.structs.replace(frame, records=events))
            used = self._sizes[frame.robot] + len(data) > 2 * self._share
            if not events or used or self._size + len(data) > 2 * self._most:
                return b""
        self._sizes[frame.robot] += len(data)
        self._size += len(data)
        return data

    def _begin(self, now: float) -> None:
        self.close()
        self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        kept = segments(self._folder)
        oldest = time.time() - MINUTES * 60 - SEGMENT
        for index, segment in enumerate(reversed(kept), 1):
            with contextlib.suppress(OSError):
                if index >= SEGMENTS or segment.stat().st_mtime < oldest:
                    segment.unlink()
        if shutil.disk_usage(self._folder).free < self._spare:
            raise OSError(28, f"less than {self._spare >> 20} MiB are free on the disk")
        number = int(kept[-1].stem) + 1 if kept else 1
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
        path = self._folder / f"{number:09d}.ring"
        self._file = FileIO(os.open(path, flags, 0o600), "w")
        self._until = now + SEGMENT
        self._size = 0
        self._sizes.clear()


def segments(folder: Path) -> list[Path]:
    """Return the segments of a ring, the oldest first."""
    return sorted(each for each in folder.glob("*.ring") if each.stem.isdigit())
