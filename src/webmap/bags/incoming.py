"""Messages that wait to be written: in the order in which they came, all of them."""

import asyncio
import logging
import threading
from collections.abc import Callable
from queue import SimpleQueue

from webmap.bags.recorder import Recorder
from webmap.errors import ProtocolError
from webmap.ros.events import Publish

log = logging.getLogger("webmap.bags")

HELD = 256 << 20
"""Bytes of messages that may wait; what comes when there are more is left out."""

ASIDE = 1 << 10
"""Bytes that a message needs in memory beside its frame, about."""


class Incoming:
    """Decodes and writes messages in a thread, so that the link is read meanwhile.

    Args:
        recorder: Writes them; nobody else lets it :meth:`Recorder.take` any.
        failed: Called in that thread if the file cannot be written any more.

    """

    def __init__(self, recorder: Recorder, failed: Callable[[OSError], object]) -> None:
        self._recorder = recorder
        self._failed = failed
        self._waiting: SimpleQueue[tuple[str, Publish, int] | None] = SimpleQueue()
        self._lock = threading.Lock()
        self._size = 0
        """How many bytes are waiting, as :func:`_size_of` counts them."""
        self._thread = threading.Thread(
            target=self._write_on, name="recording", daemon=True
        )

    def start(self) -> None:
        """Begin to write."""
        self._thread.start()

    def put(self, topic: str, message: Publish, time: int) -> None:
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

    def _write(self, topic: str, message: Publish, time: int) -> None:
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


def _size_of(message: Publish) -> int:
    return len(message.frame) + ASIDE
