"""Writes received messages to a bag, and reports those that cannot be written."""

import asyncio
import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any

from webmap.bags.bag_file import BagFile
from webmap.bags.types import Types, TypeVersion
from webmap.base.errors import ProtocolError
from webmap.ros.message_check import Misfit
from webmap.ros.received_message import ReceivedMessage

log = logging.getLogger("webmap.bags")

HELD = 256 << 20
"""Bytes of messages that may wait; further messages are dropped."""

ASIDE = 1 << 10
"""Approximate bytes of memory that a message needs in addition to its frame."""


@dataclass(slots=True)
class _Track:
    """A recorded topic."""

    type: str
    version: TypeVersion
    """The type of the newest release, or of the one that fits its messages."""

    channel: Any = None
    misfit: bool = False
    """Whether a message did not fit its type."""


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


class Incoming:
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
        """Start the thread."""
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
