"""One process of the gate, seen from the display: started, written to, read, ended."""

import contextlib
import logging
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence

import msgspec

from webmap.base.children import python_command
from webmap.base.errors import WireError
from webmap.base.outside_text import one_line
from webmap.gate import framing
from webmap.gate.messages import FromGate

log = logging.getLogger("webmap.gate")

MAX_UNSENT = 1 << 20
"""Bytes that a gate may leave unread before it is taken for hung."""

END_PATIENCE = 2.0
"""Seconds for which a gate may send zeros and end, until it is killed."""

MAX_WORDS = 300
"""The longest line of a gate that is kept as its last words, in characters."""


class Child:
    """A running gate.

    Args:
        hear: Called with each message, in a thread of the child's own.
        ended: Called once, in that thread, when the gate has closed its end.
        command: What is run; a gate, if nothing is said.

    """

    def __init__(
        self,
        hear: Callable[["Child", FromGate], None],
        ended: Callable[["Child"], None],
        command: Sequence[str] | None = None,
    ) -> None:
        self._hear = hear
        self._ended = ended
        self._lock = threading.Lock()
        self._unsent = bytearray()
        # A session of its own: Ctrl-C in the terminal reaches the display, which
        # lets the gate stop the robots in order.
        self._process = subprocess.Popen(
            command or python_command("webmap.gate"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        assert self._process.stderr is not None
        self._in = self._process.stdin.fileno()
        self._out = self._process.stdout.fileno()
        if sys.platform != "win32":
            os.set_blocking(self._in, False)
        self._err = self._process.stderr
        self._last_words = b""
        self._reader = threading.Thread(
            target=self._read, name="webmap-gate-reader", daemon=True
        )
        self._listener = threading.Thread(
            target=self._listen, name="webmap-gate-stderr", daemon=True
        )

    @property
    def pid(self) -> int:
        """The process's number."""
        return self._process.pid

    @property
    def epitaph(self) -> str:
        """What it ended of, in words, after :meth:`stop`."""
        code = self._process.returncode
        if code is not None and code < 0:
            return f"ended by {signal.Signals(-code).name}"
        self._listener.join(1.0)
        said = one_line(self._last_words.decode("utf-8", "replace").strip(), MAX_WORDS)
        return said or f"exit code {code}, no message"

    def start(self) -> None:
        """Begin to read."""
        self._listener.start()
        self._reader.start()

    def send(self, *messages: msgspec.Struct) -> None:
        """Write messages without waiting; what does not fit goes with the next."""
        data = b"".join(map(framing.pack, messages))
        with self._lock:
            if self._in < 0:
                return
            self._unsent += data
            try:
                while self._unsent:
                    del self._unsent[: os.write(self._in, self._unsent)]
            except BlockingIOError:
                if len(self._unsent) > MAX_UNSENT:
                    self.kill("it does not read")
            except OSError:
                self._unsent.clear()  # it is gone; the reader says so

    def kill(self, why: str) -> None:
        """End the process at once: only for one that does not work any more."""
        log.error("the gate (process %d) is killed: %s", self.pid, why)
        self._process.kill()

    def stop(self, timeout: float) -> None:
        """Close the pipe, by which the gate stops its robots and ends."""
        assert self._process.stdin is not None
        with self._lock:
            self._in = -1
            self._process.stdin.close()
        try:
            self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            self.kill(f"it has not ended within {timeout:g} s")
            self._process.wait()
        if self._reader is not threading.current_thread():
            self._reader.join(1.0)

    def _listen(self) -> None:
        """Pass on what it says to people, and keep the last line."""
        with self._err, contextlib.suppress(ValueError):  # closed at our own end
            for line in self._err:
                if line.strip():
                    self._last_words = line
                said = one_line(line.decode("utf-8", "replace").rstrip("\r\n"))
                with contextlib.suppress(OSError):
                    os.write(2, f"{said}\n".encode())

    def _read(self) -> None:
        assert self._process.stdout is not None
        unpacker = framing.Unpacker(FromGate)
        try:
            while data := os.read(self._out, 1 << 16):
                for message in unpacker.feed(data):
                    self._hear(self, message)
        except WireError as error:
            self.kill(str(error))
        except Exception:
            # A fault of this side: the gate can still send its robots zero.
            log.exception("the gate's words could not be dealt with: it is ended")
            self.stop(END_PATIENCE)
        finally:
            self._process.stdout.close()
            self._ended(self)
