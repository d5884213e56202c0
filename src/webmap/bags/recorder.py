"""Writes received messages to a new bag, and reports those that it cannot write."""

import asyncio
import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, Literal

from webmap.bags.recording import is_latched
from webmap.bags.types import Types, TypeVersion
from webmap.base.errors import ConfigError, ProtocolError
from webmap.ros.message_check import Misfit
from webmap.ros.received_message import ReceivedMessage
from webmap.ros.rosbridge.server.dialect import DialectName, canonical
from webmap.ros.serialized.schemas import Schema

if TYPE_CHECKING:
    from rosbags.interfaces import Qos

log = logging.getLogger("webmap.bags")

METADATA_VERSION: Literal[8] = 8
"""The version of the metadata of a ROS 2 bag: Humble and later releases read it."""

FOREVER = (9223372036, 854775807)
"""An infinite duration in ROS 2, in seconds and nanoseconds."""


def new_bag(path: Path, dialect: DialectName) -> "BagFile":
    """Create a bag; nothing that exists is overwritten.

    Args:
        path: A file for ROS 1 (``.bag`` is added if missing), a folder for ROS 2.
        dialect: ROS 1 or ROS 2.

    Raises:
        ConfigError: If the path exists, does not fit the dialect, or rosbags cannot
            make a bag of it.
        OSError: If the bag cannot be written there.

    """
    if dialect == "ros1" and path.suffix != ".bag":
        path = path.with_name(f"{path.name}.bag")
    if dialect == "ros2" and path.suffix in (".bag", ".mcap", ".db3"):
        raise ConfigError(
            f"{path}: a bag of ROS 2 is a folder; give it a name without {path.suffix}"
        )
    if path.exists():
        raise ConfigError(f"{path} exists already, and nothing is overwritten")
    from rosbags.rosbag1 import WriterError as Ros1Error
    from rosbags.rosbag2 import WriterError as Ros2Error

    try:
        return BagFile(path, dialect)
    except (Ros1Error, Ros2Error) as error:
        raise ConfigError(f"{path} cannot be created: {error}") from None


class BagFile:
    """A bag that is written message by message.

    A bag of ROS 1 is one file, which is complete only when it is closed. One of ROS 2
    is a folder with an MCAP file and its description. MCAP holds the definitions of the
    types, and most of an unclosed file can be recovered: all but the last chunk, which
    is a megabyte before its compression. rosbags writes sqlite3 as one transaction, of
    which nothing would remain.

    Args:
        path: The file or the folder.
        dialect: ROS 1 or ROS 2.

    """

    def __init__(self, path: Path, dialect: DialectName) -> None:
        self.path = path
        self._writer = _writer(path, dialect)
        self._ros2 = dialect == "ros2"
        self._writer.open()

    def add(self, topic: str, version: TypeVersion) -> Any:
        """Add a topic, and return the channel for its messages."""
        latched = is_latched(topic, canonical(version.type_name))
        if self._ros2:
            details: dict[str, Any] = {"offered_qos_profiles": [_kept()] * latched}
        else:
            details = {"callerid": "/webmap", "latching": int(latched)}
        return self._writer.add_connection(
            topic, version.type_name, typestore=version.store, **details
        )

    def write(self, channel: Any, time: int, data: bytes) -> None:
        """Write a message, with its time of arrival in nanoseconds since 1970."""
        self._writer.write(channel, time, data)

    def close(self) -> None:
        """Complete and close the file, so that other programs can open it."""
        self._writer.close()


def _writer(path: Path, dialect: DialectName) -> Any:
    if dialect == "ros1":
        from rosbags.rosbag1 import Writer

        return Writer(path)
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
    from rosbags.rosbag2 import Writer as Ros2Writer

    mcap = StoragePlugin.MCAP
    writer = Ros2Writer(path, version=METADATA_VERSION, storage_plugin=mcap)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    return writer


def _kept() -> "Qos":
    """Return the quality of service of a publisher that latches its newest message."""
    from rosbags.interfaces import (
        Qos,
        QosDurability,
        QosHistory,
        QosLiveliness,
        QosReliability,
        QosTime,
    )

    forever = QosTime(*FOREVER)
    return Qos(
        history=QosHistory.KEEP_LAST,
        depth=1,
        reliability=QosReliability.RELIABLE,
        durability=QosDurability.TRANSIENT_LOCAL,
        deadline=forever,
        lifespan=forever,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=forever,
        avoid_ros_namespace_conventions=False,
    )


_PLAIN_CDR = (b"\0\0", b"\0\1")
"""How messages begin in the encoding that bags of ROS 2 have."""

HELD = 256 << 20
"""Bytes of messages that may wait; further messages are dropped."""

ASIDE = 1 << 10
"""Approximate bytes of memory that a message needs in addition to its frame."""


@dataclass(slots=True)
class _Track:
    type: str
    version: TypeVersion
    """The type of the newest release, or of the one that fits its messages."""

    channel: Any = None
    misfit: bool = False
    """Whether a message did not fit its type."""

    schema: Schema | None = None
    """The schema of the newest message that came serialized."""

    as_it_is: bool = False
    """Whether messages of that schema are written without a change."""


class Recorder:
    """Writes messages as they come. It uses no clock and no bridge.

    Args:
        bag: The bag to write to.
        types: The types of messages.
        report: Called with a sentence about each kind of dropped message.

    """

    def __init__(
        self, bag: BagFile, types: Types, report: Callable[[str], object]
    ) -> None:
        self.messages = 0
        """Number of written messages."""
        self.size = 0
        """Bytes of the written messages."""
        self.dropped = 0
        """Number of dropped messages: misfits, unreadable ones, or too many at once."""
        self._bag = bag
        self._types = types
        self._report = report
        self._tracks: dict[str, _Track] = {}
        self._lock = threading.Lock()
        self._reported: set[tuple[str, str]] = set()

    @property
    def topics(self) -> int:
        """Number of topics with messages in the bag."""
        return sum(track.channel is not None for track in self._tracks.values())

    def add(self, topic: str, type_name: str) -> bool:
        """Add a topic; return False if its type cannot be written.

        Args:
            topic: The name of the topic.
            type_name: Its type, in either dialect.

        """
        version = next(self._types.versions(type_name), None)
        if version is not None:
            self._tracks[topic] = _Track(type_name, version)
        return version is not None

    def take(self, topic: str, message: object, time: int) -> None:
        """Write a message of an added topic.

        Args:
            topic: The name of the topic.
            message: The value from :meth:`webmap.Bridge.subscribe` without ``decode``.
            time: Its time of arrival, in nanoseconds since 1970.

        Raises:
            OSError: If the file cannot be written.

        """
        track = self._tracks[topic]
        try:
            data = self._bytes_of(track, message)
        except Misfit as error:
            track.misfit = True
            why = f"messages that do not fit the type {track.type} are not recorded"
            self.drop(topic, why, str(error))
            return
        self._write(track, topic, data, time)

    def take_serialized(
        self, topic: str, schema: Schema, data: bytes | bytearray, time: int
    ) -> bool:
        """Write the bytes of a message without a change.

        Args:
            topic: The name of the topic.
            schema: The definition of the message's type.
            data: The message, as ROS nodes send it.
            time: Its time of arrival, in nanoseconds since 1970.

        Returns:
            False if they are not those of the topic's type in the bag.

        Raises:
            OSError: If the file cannot be written.

        """
        track = self._tracks[topic]
        if track.schema is not schema:
            track.schema = schema
            track.as_it_is = self._choose(track, schema)
        if not track.as_it_is or (schema.ros2 and data[:2] not in _PLAIN_CDR):
            return False
        self._write(track, topic, bytes(data), time)
        return True

    def _choose(self, track: _Track, schema: Schema) -> bool:
        """Choose the release with this schema; return whether there is one."""
        if track.channel is not None:
            return track.version.has(schema)
        for version in self._types.versions(track.type):
            if version.has(schema):
                track.version = version
                return True
        return False

    def _write(self, track: _Track, topic: str, data: bytes, time: int) -> None:
        if track.channel is None:
            track.channel = self._bag.add(topic, track.version)
        self._bag.write(track.channel, time, data)
        self.messages += 1
        self.size += len(data)

    def drop(self, topic: str, why: str, error: str = "") -> None:
        """Count a dropped message; callable from any thread.

        Args:
            topic: The name of the topic.
            why: The reason; shown once for each topic.
            error: The error of the first one, if known.

        """
        with self._lock:
            self.dropped += 1
            new = (topic, why) not in self._reported
            self._reported.add((topic, why))
        if new:
            self._report(f"{topic}: {why}{f': {error}' if error else ''}")

    def _bytes_of(self, track: _Track, message: object) -> bytes:
        """Return a message's bytes; the first message determines the release."""
        try:
            return track.version.bytes_of(message)
        except Misfit:
            if track.channel is not None or track.misfit:
                raise
            for version in self._types.versions(track.type):
                try:
                    data = version.bytes_of(message)
                except Misfit:
                    continue
                track.version = version
                return data
            raise


class RecorderThread:
    """Decodes and writes messages in a thread, so that reading can continue.

    Args:
        recorder: Writes the messages; only this object may call :meth:`Recorder.take`.
        failed: Called in that thread if the file can no longer be written.

    """

    def __init__(self, recorder: Recorder, failed: Callable[[OSError], object]) -> None:
        self._recorder = recorder
        self._failed = failed
        self._waiting: SimpleQueue[tuple[str, ReceivedMessage, int] | None] = (
            SimpleQueue()
        )
        self._lock = threading.Lock()
        self._size = 0
        """Bytes that wait, as counted by :func:`_size_of`."""
        self._thread = threading.Thread(
            target=self._write_all, name="recording", daemon=True
        )

    def start(self) -> None:
        """Begin to write the queued messages."""
        self._thread.start()

    def put(self, topic: str, message: ReceivedMessage, time: int) -> None:
        """Queue a received message; if too many wait, it is counted as dropped.

        Args:
            topic: The name of the topic.
            message: The message, not decoded yet.
            time: Its time of arrival, in nanoseconds since 1970.

        """
        size = _size_of(message)
        with self._lock:
            full = self._size > 0 and self._size + size > HELD
            if not full:
                self._size += size
        if full:
            self._recorder.drop(
                topic,
                "messages are not recorded, since more arrive than can be written",
            )
        else:
            self._waiting.put((topic, message, time))

    async def finish(self) -> None:
        """Wait until all queued messages are written."""
        self._waiting.put(None)
        await asyncio.to_thread(self._thread.join)

    def _write_all(self) -> None:
        while (one := self._waiting.get()) is not None:
            try:
                self._write(*one)
            except OSError as error:  # such as a full disk
                self._failed(error)
                return
            with self._lock:
                self._size -= _size_of(one[1])

    def _write(self, topic: str, message: ReceivedMessage, time: int) -> None:
        try:
            serialized = message.serialized
            if serialized is None or not self._recorder.take_serialized(
                topic, *serialized, time
            ):
                self._recorder.take(topic, message.decode(), time)
        except ProtocolError as error:
            why = "messages that cannot be read are not recorded"
            self._recorder.drop(topic, why, str(error))
        except OSError:
            raise
        except Exception as error:  # the next message must be written in any case
            log.exception("a message on %s was lost", topic)
            why = "messages that cannot be written are not recorded"
            self._recorder.drop(topic, why, str(error))


def _size_of(message: ReceivedMessage) -> int:
    return len(message.frame) + ASIDE
