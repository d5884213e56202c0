"""Starts the gate's process, watches it and restarts it."""

import contextlib
import logging
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from typing import Protocol

import msgspec

from webmap.base.errors import WireError
from webmap.base.processes import python_command
from webmap.base.text import one_line
from webmap.gate import pipe, protocol
from webmap.gate.protocol import FromGate

FIRST_PAUSE = 0.25
"""Seconds until the next start after a gate has ended twice in a row."""

LONGEST_PAUSE = 4.0
"""Seconds between the end of a gate and the next start, at most."""

LIVED = 10.0
"""Seconds after which the end of a gate counts as the first in a row."""


class Restarts:
    """Decides when the display starts its next gate."""

    def __init__(self) -> None:
        self.failing = False
        """Whether several gates in a row have ended soon after their start."""
        self._pause = 0.0
        self._due = float("-inf")
        self._started_at = float("-inf")

    def due(self, now: float) -> bool:
        """Return whether it is time to start a gate."""
        return now >= self._due

    def started(self, now: float) -> None:
        """Note that a gate was started, or an attempt to start one."""
        self._started_at = now

    def ended(self, now: float) -> None:
        """Note that the gate has ended.

        The next one is started at once, because no gate controls the robots now. If
        that one ends soon as well, there is a pause, which doubles each time.
        """
        lived = now - self._started_at >= LIVED
        self.failing = self._pause > 0.0 and not lived
        if lived:
            self._pause = 0.0
        self._due = now + self._pause
        self._pause = min(max(2 * self._pause, FIRST_PAUSE), LONGEST_PAUSE)

    def lives(self, now: float) -> None:
        """Note that the gate still runs."""
        if self.failing and now - self._started_at >= LIVED:
            self.failing = False


def in_words(reason: str, *, spoke: bool) -> str:
    """Return the message about gates that end repeatedly.

    Args:
        reason: Why the last one ended.
        spoke: Whether it had reported that it runs.

    """
    what = "ended repeatedly" if spoke else "does not start"
    return (
        f"The gate {what}: {reason}. WebMap restarts the gate. Until it runs, WebMap "
        "cannot drive robots; WebMap keeps a STOP and sends it after the restart."
    )


log = logging.getLogger("webmap.gate")

MAX_UNSENT = 1 << 20
"""A gate that leaves more bytes than this unread counts as hung."""

END_PATIENCE = 2.0
"""Seconds that a gate has to send zeros and end, before it is killed."""

MAX_WORDS = 300
"""The longest last line of a gate that is kept as the reason of its end, in
characters."""


class GateProcess:
    """A running gate.

    Args:
        hear: Called with each message, in a thread of this object.
        ended: Called once, in that thread, when the gate has closed its pipe.
        command: The command to run; a gate by default.

    """

    def __init__(
        self,
        hear: Callable[["GateProcess", FromGate], None],
        ended: Callable[["GateProcess"], None],
        command: Sequence[str] | None = None,
    ) -> None:
        self._hear = hear
        self._ended = ended
        self._lock = threading.Lock()
        self._unsent = bytearray()
        # A session of its own: Ctrl-C in the terminal reaches only the display, which
        # lets the gate stop the robots and end.
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
        self._last_line = b""
        self._reader = threading.Thread(
            target=self._read, name="webmap-gate-reader", daemon=True
        )
        self._listener = threading.Thread(
            target=self._listen, name="webmap-gate-stderr", daemon=True
        )

    @property
    def pid(self) -> int:
        """The id of the process, which may have ended."""
        return self._process.pid

    @property
    def end_reason(self) -> str:
        """Why the process ended, after :meth:`stop`."""
        code = self._process.returncode
        if code is not None and code < 0:
            return f"ended by {signal.Signals(-code).name}"
        self._listener.join(1.0)
        text = one_line(self._last_line.decode("utf-8", "replace").strip(), MAX_WORDS)
        return text or f"exit code {code}, no message"

    def start(self) -> None:
        """Start the threads that read messages and log lines of the gate."""
        self._listener.start()
        self._reader.start()

    def send(self, *messages: msgspec.Struct) -> None:
        """Write messages without waiting; the rest follows with the next call."""
        data = b"".join(map(pipe.pack, messages))
        with self._lock:
            if self._in < 0:
                return
            self._unsent += data
            try:
                while self._unsent:
                    del self._unsent[: os.write(self._in, self._unsent)]
            except BlockingIOError:
                if len(self._unsent) > MAX_UNSENT:
                    self.kill("it does not read its pipe")
            except OSError:
                self._unsent.clear()  # the gate has ended; the reader reports it

    def kill(self, why: str) -> None:
        """Kill a process that does not work any more."""
        log.error("the gate (process %d) is killed: %s", self.pid, why)
        self._process.kill()

    def stop(self, timeout: float) -> None:
        """Close the pipe: the gate then stops its robots and ends."""
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
        """Copy the gate's error output to the display's, and keep the last line."""
        with self._err, contextlib.suppress(ValueError):  # closed by this process
            for line in self._err:
                if line.strip():
                    self._last_line = line
                text = one_line(line.decode("utf-8", "replace").rstrip("\r\n"))
                with contextlib.suppress(OSError):
                    os.write(2, f"{text}\n".encode())

    def _read(self) -> None:
        assert self._process.stdout is not None
        unpacker = pipe.Unpacker(FromGate)
        try:
            while data := os.read(self._out, 1 << 16):
                for message in unpacker.feed(data):
                    self._hear(self, message)
        except WireError as error:
            self.kill(str(error))
        except Exception:
            # An error of the display: the gate can still send zeros to its robots.
            log.exception("the gate is ended: its message could not be processed")
            self.stop(END_PATIENCE)
        finally:
            self._process.stdout.close()
            self._ended(self)


HEARTBEAT = 0.05
"""Seconds between two heartbeats to the gate."""

HUNG = 60
"""Heartbeats without a message after which a running gate counts as hung."""

SLOW_START = 400
"""Heartbeats that a gate has until its first message."""

STOP_TIMEOUT = 2.0
"""Seconds that the gate has to end; it needs half a second for its zeros."""


class GateListener(Protocol):
    """The owner of a :class:`Supervisor`, which exchanges messages with the gate."""

    def introduction(self) -> list[protocol.ToGate]:
        """Return the first messages for a new gate."""

    def hear(self, message: FromGate) -> None:
        """Process a message from the gate, in the gate's reader thread."""

    def gone(self, down: protocol.GateDown) -> None:
        """Note that the gate has ended, in any thread."""


class GateLink(Protocol):
    """How a client reaches its gate: by a pipe, or through an agent."""

    @property
    def ready(self) -> bool:
        """Whether a gate receives messages."""

    @property
    def trouble(self) -> str | None:
        """Why there is no gate, if that is known."""

    @property
    def pid(self) -> int | None:
        """The process id of the gate, if it runs on this computer."""

    def start(self) -> None:
        """Begin; a second call does nothing."""

    def stop(self) -> None:
        """Stop every driven robot, and end."""

    def send(self, message: protocol.ToGate) -> None:
        """Send a message to the gate, if there is one."""


class Supervisor:
    """Keeps one gate running.

    Args:
        owner: Receives the gate's messages.
        lock: Held while the gate changes and while a message is sent to it.

    """

    def __init__(self, owner: GateListener, lock: "threading.RLock") -> None:
        self.ready = False
        """Whether the present gate has reported that it runs."""
        self.trouble: str | None = None
        """Why there is no gate, if several in a row have ended."""
        self._owner = owner
        self._lock = lock
        self._child: GateProcess | None = None
        self._silent_beats = 0
        self._ending = threading.Event()
        self._heart: threading.Thread | None = None
        self._restarts = Restarts()

    @property
    def pid(self) -> int | None:
        """The process id of the gate, if it runs."""
        child = self._child
        return None if child is None else child.pid

    def start(self) -> None:
        """Start the gate and keep it running; a second call does nothing."""
        with self._lock:
            if self._heart is not None:
                return
            self._ending.clear()
            self._heart = threading.Thread(
                target=self._beat, name="webmap-gate-heartbeat", daemon=True
            )
            self._heart.start()

    def stop(self) -> None:
        """Stop every driven robot and end the gate; return after that."""
        with self._lock:
            heart, self._heart = self._heart, None
        if heart is None:
            return
        self.end_heartbeat(heart)
        with self._lock:
            child, self._child = self._child, None
        if child is not None:
            child.stop(STOP_TIMEOUT)
        self.ready = False
        self._owner.gone(protocol.GateDown("the gate was ended"))

    def end_heartbeat(self, heart: threading.Thread | None = None) -> None:
        """Stop the heartbeats; the gate notices that by itself."""
        self._ending.set()
        thread = heart or self._heart
        if thread is not None:
            thread.join()

    def send(self, message: protocol.ToGate) -> None:
        """Send a message to the gate, if it runs."""
        with self._lock:
            if self._child is not None:
                self._child.send(message)

    def _beat(self) -> None:
        beat = protocol.Heartbeat()
        while not self._ending.is_set():
            child, now = self._child, time.monotonic()
            if child is not None:
                child.send(beat)
                self._check_alive(child)
                self._restarts.lives(now)
            elif self._restarts.due(now):
                self._restarts.started(now)
                self._spawn()
            self._ending.wait(HEARTBEAT)

    def _check_alive(self, child: GateProcess) -> None:
        """Kill a gate that runs but sends nothing for too many heartbeats.

        A clock would also count the time in which this process was stopped.
        """
        self._silent_beats += 1
        if self._silent_beats > (HUNG if self.ready else SLOW_START):
            self._silent_beats = 0
            child.kill("it does not respond")

    def _spawn(self) -> None:
        try:
            child = GateProcess(self._hear, self._ended)
        except OSError as error:
            self._note_end(str(error))
            return
        with self._lock:
            self._child, self._silent_beats = child, 0
            child.send(protocol.Heartbeat(), *self._owner.introduction())
        child.start()

    def _hear(self, child: GateProcess, message: FromGate) -> None:
        with self._lock:
            if child is not self._child:
                return
            self._silent_beats = 0
            if isinstance(message, protocol.Ready):
                self.ready = True
        self._owner.hear(message)

    def _ended(self, child: GateProcess) -> None:
        with self._lock:
            if child is not self._child:
                return
            self._child = None
        child.stop(STOP_TIMEOUT)
        self._note_end(child.end_reason)

    def _note_end(self, reason: str) -> None:
        self._restarts.ended(time.monotonic())
        spoke, self.ready = self.ready, False
        log.error("the gate has ended (%s); WebMap starts it again", reason)
        failing = self._restarts.failing
        self.trouble = in_words(reason, spoke=spoke) if failing else None
        why = self.trouble or f"the gate has ended: {reason}"
        self._owner.gone(protocol.GateDown(why, failing))
