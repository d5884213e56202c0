"""Starts the gate, sees that it lives, and starts another when it has ended."""

import logging
import threading
import time
from typing import Protocol

from webmap.gate import messages
from webmap.gate.display.child import Child
from webmap.gate.display.restarts import Restarts, in_words
from webmap.gate.messages import FromGate

log = logging.getLogger("webmap.gate")

HEARTBEAT = 0.05
"""Seconds between two signs of life to the gate."""

HUNG = 60
"""Heartbeats without a word from a gate that runs until it is taken for hung."""

SLOW_START = 400
"""Heartbeats that a gate may take to say its first word."""

STOP_TIMEOUT = 2.0
"""Seconds that the gate is given to end; it needs half a second for its zeros."""


class Owner(Protocol):
    """Whom the gate talks to."""

    def introduction(self) -> list[messages.ToGate]:
        """Return what a new gate must hear first."""

    def hear(self, message: FromGate) -> None:
        """Take in what it says, in a thread of the gate's own."""

    def gone(self, down: messages.GateDown) -> None:
        """Note that it is gone, in any thread."""


class Supervisor:
    """Keeps one gate running.

    Args:
        owner: Whom it talks to.
        lock: Held while the gate changes and while anything is told to it.

    """

    def __init__(self, owner: Owner, lock: "threading.RLock") -> None:
        self.ready = False
        """Whether the gate that runs now has said so."""
        self.trouble: str | None = None
        """Why there is none, in words, if one after the other ends."""
        self._owner = owner
        self._lock = lock
        self._child: Child | None = None
        self._silent_beats = 0
        self._ending = threading.Event()
        self._heart: threading.Thread | None = None
        self._restarts = Restarts()

    @property
    def pid(self) -> int | None:
        """The number of the gate's process, if it runs."""
        child = self._child
        return None if child is None else child.pid

    def start(self) -> None:
        """Begin; the second call does nothing."""
        with self._lock:
            if self._heart is not None:
                return
            self._ending.clear()
            self._heart = threading.Thread(
                target=self._beat, name="webmap-gate-heartbeat", daemon=True
            )
            self._heart.start()

    def stop(self) -> None:
        """Have every driven robot stopped and the gate ended; returns after that."""
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
        self._owner.gone(messages.GateDown("the gate was ended"))

    def end_heartbeat(self, heart: threading.Thread | None = None) -> None:
        """Give no sign of life any more, and have the gate find out by itself."""
        self._ending.set()
        thread = heart or self._heart
        if thread is not None:
            thread.join()

    def tell(self, message: messages.ToGate) -> None:
        """Send a message to the gate, if it runs."""
        with self._lock:
            if self._child is not None:
                self._child.send(message)

    def _beat(self) -> None:
        beat = messages.Heartbeat()
        while not self._ending.is_set():
            child, now = self._child, time.monotonic()
            if child is not None:
                child.send(beat)
                self._check_words(child)
                self._restarts.lives(now)
            elif self._restarts.due(now):
                self._restarts.started(now)
                self._spawn()
            self._ending.wait(HEARTBEAT)

    def _check_words(self, child: Child) -> None:
        """Kill a gate that runs and says nothing; counted in our own heartbeats.

        A clock would also count the time in which this process stood still.
        """
        self._silent_beats += 1
        if self._silent_beats > (HUNG if self.ready else SLOW_START):
            self._silent_beats = 0
            child.kill("it does not respond")

    def _spawn(self) -> None:
        try:
            child = Child(self._hear, self._ended)
        except OSError as error:
            self._note_end(str(error))
            return
        with self._lock:
            self._child, self._silent_beats = child, 0
            child.send(messages.Heartbeat(), *self._owner.introduction())
        child.start()

    def _hear(self, child: Child, message: FromGate) -> None:
        with self._lock:
            if child is not self._child:
                return
            self._silent_beats = 0
            if isinstance(message, messages.Ready):
                self.ready = True
        self._owner.hear(message)

    def _ended(self, child: Child) -> None:
        with self._lock:
            if child is not self._child:
                return
            self._child = None
        child.stop(STOP_TIMEOUT)
        self._note_end(child.epitaph)

    def _note_end(self, epitaph: str) -> None:
        self._restarts.ended(time.monotonic())
        spoke, self.ready = self.ready, False
        log.error("the gate has ended (%s); WebMap starts it again", epitaph)
        failing = self._restarts.failing
        self.trouble = in_words(epitaph, spoke=spoke) if failing else None
        why = self.trouble or f"the gate has ended: {epitaph}"
        self._owner.gone(messages.GateDown(why, failing))
