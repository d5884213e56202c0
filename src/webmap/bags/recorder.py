"""What becomes of messages that are recorded: bytes in a bag, or a word why not."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from webmap.bags.bag_file import BagFile
from webmap.bags.types import Types, Way
from webmap.bags.writing import Misfit


@dataclass(slots=True)
class _Track:
    """A topic that is recorded."""

    type: str
    way: Way
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
        way = next(self._types.ways(type_name), None)
        if way is not None:
            self._tracks[topic] = _Track(type_name, way)
        return way is not None

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
            track.channel = self._bag.add(topic, track.way)
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
            return track.way.bytes_of(message)
        except Misfit:
            if track.channel is not None or track.misfit:
                raise
            for way in self._types.ways(track.type):
                try:
                    data = way.bytes_of(message)
                except Misfit:
                    continue
                track.way = way
                return data
            raise
