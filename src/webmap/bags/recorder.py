"""What becomes of messages that are recorded: bytes in a bag, or a word why not."""

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
from webmap.ros.conforming import Misfit
from webmap.ros.received import ReceivedMessage

log = logging.getLogger("webmap.bags")

HELD = 256 << 20
"""Bytes of messages that may wait; what comes when there are more is left out."""

ASIDE = 1 << 10
"""Bytes that a message needs in memory beside its frame, about."""


@dataclass(slots=True)
class _Track:
    """A topic that is recorded."""

    type: str
    version: TypeVersion
    """As the newest release has the type, or the one that its messages fit."""

    channel: Any = None
    misfit: bool = False
    """Whether a message came that does not fit its type."""


class Recorder:
    """Writes messages as they come. It asks no clock, and no bridge.

    Args:
        bag: Where they are written.
        types: Knows how.
        say: Told in a sentence what is left out.

    """

    def __init__(
        self, bag: BagFile, types: Types, say: Callable[[str], object]
    ) -> None:
        self.messages = 0
        """How many were written."""
        self.size = 0
        """How many bytes they are."""
        self.dropped = 0
        """How many were not written: misfits, unreadable ones, and too many at once."""
        self._bag = bag
        self._types = types
        self._say = say
        self._tracks: dict[str, _Track] = {}
        self._lock = threading.Lock()
        self._told: set[tuple[str, str]] = set()

    @property
    def topics(self) -> int:
        """How many topics have messages in the bag."""
        return sum(track.channel is not None for track in self._tracks.values())

    def add(self, topic: str, type_name: str) -> bool:
        """Take in a topic; return False if its type cannot be written.

        Args:
            topic: Its name.
            type_name: In the spelling of either ROS.

        """
        version = next(self._types.versions(type_name), None)
        if version is not None:
            self._tracks[topic] = _Track(type_name, version)
        return version is not None

    def take(self, topic: str, message: object, time: int) -> None:
        """Write a message of a topic that was added.

        Args:
            topic: Its name.
            message: As :meth:`webmap.Bridge.subscribe` gives it, without ``decode``.
            time: When it came, in nanoseconds since 1970.

        Raises:
            OSError: If the file cannot be written.

        """
        track = self._tracks[topic]
        try:
            data = self._bytes_of(track, message)
        except Misfit as error:
            track.misfit = True
            why = f"messages are left out that do not fit the type {track.type}"
            self.drop(topic, why, str(error))
            return
        if track.channel is None:
            track.channel = self._bag.add(topic, track.version)
        self._bag.write(track.channel, time, data)
        self.messages += 1
        self.size += len(data)

    def drop(self, topic: str, why: str, error: str = "") -> None:
        """Count a message that is not written, from any thread.

        Args:
            topic: Its name.
            why: What is said of it, once for each topic.
            error: What was wrong with the first one, if that is known.

        """
        with self._lock:
            self.dropped += 1
            new = (topic, why) not in self._told
            self._told.add((topic, why))
        if new:
            self._say(f"{topic}: {why}{f': {error}' if error else ''}")

    def _bytes_of(self, track: _Track, message: object) -> bytes:
        """Return a message's bytes; the first one tells which release's they are."""
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
    """Decodes and writes messages in a thread, so that the link is read meanwhile.

    Args:
        recorder: Writes them; nobody else lets it :meth:`Recorder.take` any.
        failed: Called in that thread if the file cannot be written any more.

    """

    def __init__(self, recorder: Recorder, failed: Callable[[OSError], object]) -> None:
        self._recorder = recorder
        self._failed = failed
        self._waiting: SimpleQueue[tuple[str, ReceivedMessage, int] | None] = (
            SimpleQueue()
        )
        self._lock = threading.Lock()
        self._size = 0
        """How many bytes are waiting, as :func:`_size_of` counts them."""
        self._thread = threading.Thread(
            target=self._write_on, name="recording", daemon=True
        )

    def start(self) -> None:
        """Begin to write."""
        self._thread.start()

    def put(self, topic: str, message: ReceivedMessage, time: int) -> None:
        """Take a message that came; it is counted as dropped if too many wait.

        Args:
            topic: Its name.
            message: As it came, not decoded yet.
            time: When it came, in nanoseconds since 1970.

        """
        size = _size_of(message)
        with self._lock:
            full = self._size > 0 and self._size + size > HELD
            if not full:
                self._size += size
        if full:
            self._recorder.drop(
                topic, "messages are left out, since more come than can be written"
            )
        else:
            self._waiting.put((topic, message, time))

    async def finish(self) -> None:
        """Return once all that came is written."""
        self._waiting.put(None)
        await asyncio.to_thread(self._thread.join)

    def _write_on(self) -> None:
        while (one := self._waiting.get()) is not None:
            try:
                self._write(*one)
            except OSError as error:  # the disk is full, for one
                self._failed(error)
                return
            with self._lock:
                self._size -= _size_of(one[1])

    def _write(self, topic: str, message: ReceivedMessage, time: int) -> None:
        try:
            self._recorder.take(topic, message.decode(), time)
        except ProtocolError as error:
            why = "messages are left out that cannot be read"
            self._recorder.drop(topic, why, str(error))
        except OSError:
            raise
        except Exception as error:  # whatever came, the next message is due
            log.exception("a message on %s was lost", topic)
            why = "messages are left out that could not be written"
            self._recorder.drop(topic, why, str(error))


def _size_of(message: ReceivedMessage) -> int:
    return len(message.frame) + ASIDE
