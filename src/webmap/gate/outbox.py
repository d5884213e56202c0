"""What the gate says to the display, and to its log, without ever waiting for them.

A display that does not read, or a terminal that was stopped with Ctrl-S, must not hold
up the process that stops robots. So writing is a thread's work.
"""

import contextlib
import logging
import os
import queue
import threading

from webmap.gate import framing
from webmap.gate.messages import FromGate, RobotReport, SentTwist, Tick

FULL = 1000
"""Messages waiting, from which on those are dropped that newer ones replace."""

OVERFULL = 20_000
"""Messages waiting, from which on every one is dropped."""


class Outbox:
    """Writes messages to a pipe in a thread of its own.

    Args:
        file: The descriptor of the pipe.

    """

    def __init__(self, file: int) -> None:
        self._file = file
        self._queue: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._thread = threading.Thread(
            target=self._write, name="gate-outbox", daemon=True
        )
        self._thread.start()

    def put(self, message: FromGate) -> None:
        """Have a message written soon."""
        waiting = self._queue.qsize()
        if waiting > OVERFULL:
            return
        if waiting > FULL and isinstance(message, Tick | RobotReport | SentTwist):
            return
        self._queue.put(framing.pack(message))

    def close(self, timeout: float) -> None:
        """Write what is waiting, for ``timeout`` seconds at most."""
        self._queue.put(None)
        self._thread.join(timeout)

    def _write(self) -> None:
        with contextlib.suppress(OSError):  # nobody is there to read any more
            while (data := self._queue.get()) is not None:
                while data:
                    data = data[os.write(self._file, data) :]


class BackgroundHandler(logging.Handler):
    """Hands records to another handler in a thread of its own; drops what is too much.

    Args:
        handler: What writes the records.

    """

    def __init__(self, handler: logging.Handler) -> None:
        super().__init__()
        self._handler = handler
        self._records: queue.Queue[logging.LogRecord | None] = queue.Queue(FULL)
        self._thread = threading.Thread(target=self._work, name="gate-log", daemon=True)
        self._thread.start()

    def emit(self, record: logging.LogRecord) -> None:
        """Have ``record`` written soon."""
        with contextlib.suppress(queue.Full):
            self._records.put_nowait(record)

    def drain(self, timeout: float) -> None:
        """Write what is waiting, for ``timeout`` seconds at most."""
        with contextlib.suppress(queue.Full):
            self._records.put_nowait(None)
        self._thread.join(timeout)

    def _work(self) -> None:
        while (record := self._records.get()) is not None:
            self._handler.handle(record)
