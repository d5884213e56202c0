"""Reading of MCAP files of any writer, also of files that were not closed.

rosbags reads MCAP files only if ``ros2 bag`` or rosbags wrote and closed them. This
reader takes the place of the one in rosbags; records are parsed by the package mcap.
"""

import heapq
import struct
import zlib
from collections.abc import Collection, Generator, Iterator
from io import BytesIO
from itertools import count, pairwise
from pathlib import Path
from typing import IO, TYPE_CHECKING, NamedTuple

from lz4.frame import LZ4FrameDecompressor
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, Schema
from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag2,
    MessageDefinition,
    MessageDefinitionFormat,
)
from rosbags.rosbag2.metadata import ReaderMetadata, parse_qos
from rosbags.typesys import get_types_from_idl, get_types_from_msg
from zstandard import ZstdDecompressor, ZstdError

from webmap.base.errors import ConfigError
from webmap.base.text import one_line
from webmap.ros.names import ros2_type

if TYPE_CHECKING:
    from rosbags.interfaces.typing import RPath

    from webmap.ros.rosbridge.server.dialect import DialectName

MAGIC = b"\x89MCAP0\r\n"
"""The first and the last bytes of a file."""

LARGEST = 256 << 20
"""Most bytes of a record, and of a chunk after its decompression."""

HELD = 512 << 20
"""Most bytes of messages in memory, while they are put in the order of their times."""

ASIDE = 400
"""Approximate bytes of memory that a message needs in addition to its data."""

LOOSE = 1 << 20
"""Bytes after which messages outside of chunks begin another part."""

_MSG, _IDL = MessageDefinitionFormat.MSG, MessageDefinitionFormat.IDL
_NO_TEXT = MessageDefinitionFormat.NONE

LANGUAGES = {
    "ros2msg": (_MSG, ("cdr", "json")),
    "ros2idl": (_IDL, ("cdr", "json")),
    "omgidl": (_IDL, ("cdr", "json")),
    "ros1msg": (_MSG, ("ros1", "json")),
    "": (_NO_TEXT, ("cdr",)),  # a type that ``ros2 bag`` found no definition of
}
"""The languages of definitions, with the encodings of messages that WebMap reads."""

_HEAD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_FOOTER = struct.Struct("<BQQQI")

DAMAGE = (McapError, struct.error, ValueError, OverflowError, ZstdError, RuntimeError)
"""The errors of the packages that read records and chunks."""

_DEFINING = (Opcode.SCHEMA, Opcode.CHANNEL)
_DATA = (*_DEFINING, Opcode.CHUNK, Opcode.MESSAGE)


class Unreadable(Exception):
    """The error of a file, or of a part of it, that cannot be read."""


class Part(NamedTuple):
    """A chunk, or messages outside of chunks that follow one another."""

    begin: int
    """The time of its first message, in nanoseconds since 1970."""
    end: int
    """The time of its last message."""
    at: int
    """Where it begins in the file, in bytes."""
    stop: int
    """Where it ends in the file."""
    channels: frozenset[int]
    """The channels with messages in it; empty if that is unknown."""


class McapFile:
    """An MCAP file, which rosbags' readers use in place of their own reader.

    Args:
        path: The file.

    """

    def __init__(self, path: "RPath") -> None:
        self.path = Path(str(path))
        self.connections: list[Connection] = []
        """The channels, as rosbags describes topics."""
        self.metadata = ReaderMetadata(0, 2**63 - 1, 0, 0, None, None, None, None)
        """The times of the first and the last message."""
        self.channels: dict[int, Channel] = {}
        self.schemas: dict[int, Schema] = {}
        self.unreadable: dict[int, str] = {}
        """Why the messages of a channel cannot be decoded."""
        self.dialect: DialectName = "ros2"
        """The ROS of its messages."""
        self.cut = ""
        """Why the file ends before its end; empty if it is complete."""
        self._parts: list[Part] = []

    def open(self) -> None:
        """Open the file and read its index; without one, read the whole file.

        Raises:
            Unreadable: If it is no MCAP file, or no message in it can be read.
            OSError: If the system does not open it.

        """
        self._file: IO[bytes] = self.path.open("rb")
        try:
            self._size = self._file.seek(0, 2)
            self._file.seek(0)
            if self._file.read(len(MAGIC)) != MAGIC:
                raise Unreadable("it is not an MCAP file")
            if not self._read_index():
                self._read_all()
            if self.cut and not self._parts:
                raise Unreadable(f"no message in it can be read: {self.cut}")
            self._describe()
        except BaseException:
            self._file.close()
            raise

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def messages(
        self,
        connections: Collection[Connection],
        start: int | None = None,
        stop: int | None = None,
    ) -> Generator[tuple[Connection, int, bytes], None, None]:
        """Yield the messages of some topics in the order of their times.

        Args:
            connections: The topics.
            start: The earliest time, in nanoseconds since 1970.
            stop: The first time that is too late.

        Raises:
            Unreadable: If the file is damaged there.

        """
        wanted = {connection.id: connection for connection in connections}
        first, last = start or 0, 2**64 if stop is None else stop
        waiting: list[tuple[int, int, int, bytes]] = []
        held, number, damage = 0, count(), None
        try:
            for part in self._parts:
                if part.end < first or part.begin >= last:
                    continue
                if part.channels and part.channels.isdisjoint(wanted):
                    continue
                while waiting and waiting[0][0] < part.begin:
                    time, _, channel, data = heapq.heappop(waiting)
                    held -= len(data) + ASIDE
                    yield wanted[channel], time, data
                for record in self._messages_in(part):
                    channel, _, time, _ = _MESSAGE.unpack_from(record)
                    if channel in wanted and first <= time < last:
                        data = record[_MESSAGE.size :]
                        heapq.heappush(waiting, (time, next(number), channel, data))
                        held += len(data) + ASIDE
                    if held > HELD:
                        raise Unreadable(
                            f"more than {HELD >> 20} MiB of its messages are not in "
                            f"the order of their times"
                        )
        except Unreadable as error:  # what was read before the damage is played
            damage = error
        while waiting:
            time, _, channel, data = heapq.heappop(waiting)
            yield wanted[channel], time, data
        if damage is not None:
            raise damage

    def _messages_in(self, part: Part) -> Iterator[bytes]:
        """Yield the message records of a part."""
        found = False
        for kind, at, _, data in self._records(self._file, part.at, part.stop):
            found = True
            for inner, record in self._inside(kind, at, data):
                if inner == Opcode.MESSAGE:
                    yield record
        if not found:
            raise Unreadable(
                f"at byte {part.at} is no chunk, although the index lists it"
            )

    def _inside(self, kind: int, at: int, data: bytes) -> Iterator[tuple[int, bytes]]:
        """Yield the records in a chunk; of any other record, the record itself."""
        if kind != Opcode.CHUNK:
            yield kind, data
            return
        try:
            content = _decompressed(Chunk.read(ReadDataStream(BytesIO(data))))
            for inner, _, _, record in self._records(BytesIO(content), 0, len(content)):
                yield inner, record
        except (Unreadable, *DAMAGE) as error:
            raise Unreadable(f"the chunk at byte {at} is damaged: {error}") from None

    def _records(
        self, file: IO[bytes], at: int, stop: int, wanted: Collection[int] = _DATA
    ) -> Iterator[tuple[int, int, int, bytes]]:
        """Yield the kind, the begin, the end and the content of wanted records."""
        while at < stop:
            file.seek(at)
            head = file.read(_HEAD.size)
            kind, size = _HEAD.unpack(head) if len(head) == _HEAD.size else (0, 0)
            end = at + _HEAD.size + size
            if kind in (Opcode.DATA_END, Opcode.FOOTER):
                return
            too_short = kind == Opcode.MESSAGE and size < _MESSAGE.size
            if kind == 0 or end > stop or too_short:
                raise Unreadable(f"the record at byte {at} is cut off or damaged")
            if kind in wanted:
                if size > LARGEST:
                    raise Unreadable(
                        f"the record at byte {at} has {size} bytes, expected at most "
                        f"{LARGEST}"
                    )
                yield kind, at, end, file.read(size)
            at = end

    def _read_index(self) -> bool:
        """Read the index at the end of the file; return False if it cannot be used."""
        size = _FOOTER.size + len(MAGIC)
        self._file.seek(max(0, self._size - size))
        tail = self._file.read()
        if len(tail) < size or tail[0] != Opcode.FOOTER or not tail.endswith(MAGIC):
            self.cut = "it was not closed"
            return False
        at = _FOOTER.unpack_from(tail)[2] or self._size
        wanted = (*_DEFINING, Opcode.CHUNK_INDEX)
        try:
            for kind, _, _, data in self._records(self._file, at, self._size, wanted):
                if kind != Opcode.CHUNK_INDEX:
                    self._define(kind, data)
                    continue
                index = ChunkIndex.read(ReadDataStream(BytesIO(data)))
                channels = frozenset(index.message_index_offsets)
                times = index.message_start_time, index.message_end_time
                if channels or times[1]:  # there are messages in it
                    begin = index.chunk_start_offset
                    place = begin, begin + index.chunk_length
                    self._parts.append(Part(*times, *place, channels))
        except (Unreadable, *DAMAGE):
            return False
        self._parts.sort(key=lambda part: part.at)
        return (
            bool(self._parts and self.channels)
            and self._parts[-1].stop <= self._size
            and all(part.channels <= self.channels.keys() for part in self._parts)
            and all(one.stop <= two.at for one, two in pairwise(self._parts))
        )

    def _read_all(self) -> None:
        """Make the index from all records, up to the end or the first damaged one."""
        self._parts.clear()
        loose = False  # whether the last part is of messages outside of chunks
        try:
            for kind, at, end, data in self._records(
                self._file, len(MAGIC), self._size
            ):
                part = self._part(kind, at, end, data)
                if part is None:
                    continue
                last = self._parts[-1] if loose and kind == Opcode.MESSAGE else None
                loose = kind == Opcode.MESSAGE
                if last is not None and end - last.at < LOOSE:
                    self._parts[-1] = Part(
                        min(last.begin, part.begin),
                        max(last.end, part.end),
                        last.at,
                        end,
                        last.channels | part.channels,
                    )
                else:
                    self._parts.append(part)
        except Unreadable as error:
            self.cut = str(error)

    def _part(self, kind: int, at: int, end: int, data: bytes) -> Part | None:
        """Return what the index has of a record; take the definitions in it."""
        times, channels = [], set()
        for inner, record in self._inside(kind, at, data):
            if inner != Opcode.MESSAGE:
                try:
                    self._define(inner, record)
                except DAMAGE as error:
                    why = f"the record at byte {at} is damaged: {error}"
                    raise Unreadable(why) from None
                continue
            channel, _, time, _ = _MESSAGE.unpack_from(record)
            if channel in self.channels:
                times.append(time)
                channels.add(channel)
        if not times:
            return None
        return Part(min(times), max(times), at, end, frozenset(channels))

    def _define(self, kind: int, data: bytes) -> None:
        stream = ReadDataStream(BytesIO(data))
        if kind == Opcode.SCHEMA:
            schema = Schema.read(stream)
            self.schemas[schema.id] = schema
        elif kind == Opcode.CHANNEL:
            channel = Channel.read(stream)
            self.channels[channel.id] = channel

    def _describe(self) -> None:
        """Describe the channels for rosbags, and note which cannot be decoded."""
        if self._parts:
            begin = min(part.begin for part in self._parts)
            end = max(part.end for part in self._parts) + 1
            self.metadata = self.metadata._replace(
                start_time=begin,
                end_time=end,
                duration=end - begin,
                message_count=len(self._parts),  # at least
            )
        self._parts.sort()
        channels = self.channels.values()
        ros1 = {one.id for one in self.schemas.values() if one.encoding == "ros1msg"}
        cdr = any(channel.message_encoding == "cdr" for channel in channels)
        self.dialect = "ros1" if ros1 and not cdr else "ros2"
        defined: set[int] = set()  # rosbags needs each definition once
        for channel in channels:
            schema = self.schemas.get(channel.schema_id)
            type_name = schema.name if schema else "no type"
            definition = MessageDefinition(_NO_TEXT, "")
            try:
                if channel.schema_id in ros1 and cdr:
                    raise Unreadable("it is of ROS 1, and other topics are of ROS 2")
                type_name = _type_of(channel, schema)
                if schema and schema.id not in defined:
                    definition = _definition_of(schema, type_name)
                    defined.add(schema.id)
            except (ConfigError, Unreadable) as error:
                self.unreadable[channel.id] = str(error)
            try:
                qos = parse_qos(channel.metadata.get("offered_qos_profiles", ""))
            except Exception:  # names and types tell which topics latch, too
                qos = []
            self.connections.append(
                Connection(
                    channel.id,
                    channel.topic,
                    type_name,
                    definition,
                    "",
                    0,
                    ConnectionExtRosbag2(channel.message_encoding, qos),
                    self,
                )
            )


def _type_of(channel: Channel, schema: Schema | None) -> str:
    """Return the name of a channel's type, as in ROS 2.

    Raises:
        ConfigError: If it is no name of a type in ROS.
        Unreadable: If the messages cannot be decoded.

    """
    if schema is None:
        raise Unreadable("the file has no definition of its type")
    _, readable = LANGUAGES.get(schema.encoding, (_NO_TEXT, ()))
    if channel.message_encoding not in readable:
        raise Unreadable(
            f"its messages are encoded as {one_line(channel.message_encoding)} and its "
            f"type as {one_line(schema.encoding)}; WebMap reads messages as cdr, ros1 "
            f"or json, with a type of ROS"
        )
    name = schema.name.replace("::", "/")
    return name if name.count("/") == 2 else ros2_type(name)


def _definition_of(schema: Schema, type_name: str) -> MessageDefinition:
    """Return the definition of a type for rosbags.

    Raises:
        Unreadable: If it is not valid.

    """
    language, _ = LANGUAGES[schema.encoding]
    try:
        text = schema.data.decode()
        if language == _MSG:
            get_types_from_msg(text, type_name)
        elif language == _IDL and not text.startswith("="):
            get_types_from_idl(text)
    except Exception as error:
        raise Unreadable(f"its definition is not valid: {one_line(error)}") from None
    return MessageDefinition(language, text)


def _decompressed(chunk: Chunk) -> bytes:
    """Return the content of a chunk; its real size is limited, not the stated one."""
    size = chunk.uncompressed_size
    if size > LARGEST:
        raise Unreadable(f"it has {size} bytes, expected at most {LARGEST}")
    match chunk.compression:
        case "":
            content = chunk.data
        case "zstd":
            reader = ZstdDecompressor().stream_reader(
                chunk.data, read_across_frames=True
            )
            content = reader.read(size + 1)
        case "lz4":
            content = LZ4FrameDecompressor().decompress(chunk.data, size + 1)
        case other:
            raise Unreadable(f"unknown compression {one_line(other)}")
    if len(content) != size:
        raise Unreadable(f"it has not the {size} bytes that it states")
    if chunk.uncompressed_crc and zlib.crc32(content) != chunk.uncompressed_crc:
        raise Unreadable("its check sum is wrong")
    return content
