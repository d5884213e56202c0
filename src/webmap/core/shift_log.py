"""The shift log: who did what with which robot, for the next shift and for evidence.

Every part of WebMap calls :meth:`ShiftLog.note`, which never blocks and never raises. A
thread of the log's own writes the lines, so that no disk delays a command.
"""

import logging
import math
import re
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import Any

import msgspec

from webmap.base.logs import Budgets
from webmap.base.text import one_line
from webmap.core.shift_files import Entry, Fact, LogFiles, read_newest
from webmap.gate.protocol import Identity

log = logging.getLogger("webmap")

MOST_SHOWN = 10_000
"""Entries that pages can show; the files have more."""

MOST_QUEUED = 4000
"""Entries that wait for the disk; further ones are counted, and lost."""

MOST_TEXT, MOST_FACT, MOST_FACTS = 500, 200, 24
"""Characters of a text, characters of a fact, and facts of one entry."""

RETRY = 5.0
"""Seconds until a failed write is tried again."""

PAUSE = 60.0
"""Seconds until a source that has used up its entries in a row may add one more, so
that nobody can push out the entries of others."""

_GOODBYE_S = 2.0
"""How long the end of the process waits for the disk, in seconds."""

_SECRETS = re.compile(r"(?<=://)[^/@\s]+(?=@)|(?<=token=)[^&\s]+|(?<=code=)[^&\s]+")
"""Users and passwords of addresses, and what signs in by an address."""


@dataclass(frozen=True, slots=True)
class RobotName:
    """A robot of a report."""

    id: str
    name: str


@dataclass(frozen=True, slots=True)
class Person:
    """Who did something."""

    name: str
    verified: bool | None = None
    """Whether a sign-in has verified the name; None for a program, and for WebMap."""
    place: str = ""
    mark: str = ""
    """The same whatever the name is; it is not written."""

    @classmethod
    def of(cls, label: str, identity: Identity | None) -> "Person":
        """Return the person with a label such as "Ana (desk 4)", as reports have it."""
        name, place = label, ""
        if label.endswith(")") and not label.endswith("(no name)"):
            name, _, place = label.removesuffix(")").rpartition(" (")
        if identity is None:
            return cls(label)
        return cls(name or label, identity.verified, place, identity.person)


class ShiftLog:
    """The log of this process; every method may be called from any thread."""

    def __init__(self) -> None:
        self.lost = 0
        """Entries since the start that were not written and never will be."""
        self.trouble = ""
        """Why the newest entries could not be written, as a sentence; else empty."""
        self.total = 0
        """Entries since the start."""
        self.restored = 0
        """Entries of earlier processes, read from the files."""
        self._shown: deque[Entry] = deque(maxlen=MOST_SHOWN)
        self._queue: deque[Entry] = deque()
        self._budgets = Budgets(pause=PAUSE, sources=MOST_SHOWN)
        self._hidden: tuple[str, ...] = ()
        self._lock = threading.Condition()
        self._thread: threading.Thread | None = None
        self._ending = False

    def note(
        self,
        kind: str,
        text: str,
        *,
        robot: Any = None,
        person: Any = None,
        **facts: Any,
    ) -> bool:
        """Add an entry; never blocks and never raises.

        Args:
            kind: What happened, as a word: ``"stop"``.
            text: The same as a sentence for people, without the name of the robot.
            robot: An object with the ``id`` and the ``name`` of a robot, or None.
            person: Who did it: an ``Operator``, a :class:`Person`, the name of a
                program, or None.
            **facts: Numbers and short texts.

        Returns:
            Whether the entry was added: a source that adds too many has to wait.

        """
        try:
            return self._add(kind, text, robot, person, facts)
        except Exception:
            log.exception("an entry of the shift log was not added")
            return False

    def _add(
        self,
        kind: str,
        text: str,
        robot: Any,
        person: Any,
        facts: dict[str, Any],
    ) -> bool:
        match person:
            case Person():
                who = person
            case str() | None:
                who = Person(person or "")
            case _:
                mark = Identity(person.person, verified=person.verified)
                who = Person.of(person.label, mark)
        about = "" if robot is None else robot.id
        more = self._budgets.note((kind,), f"{about}\n{who.mark or who.name}")
        if more is None:
            return False
        now = time.time()
        entry = Entry(
            time=_utc(now),
            unix=round(now, 3),
            kind=self._plain(kind, 40),
            text=self._plain(text, MOST_TEXT) + more,
            robot=self._plain(about, 100),
            robot_name="" if robot is None else self._plain(robot.name, 100),
            person=self._plain(who.name, 100),
            verified=who.verified,
            place=self._plain(who.place, 100),
            facts={
                key: self._fact(value)
                for key, value in list(facts.items())[:MOST_FACTS]
            },
        )
        with self._lock:
            self._shown.append(entry)
            self.total += 1
            if len(self._queue) < MOST_QUEUED:
                self._queue.append(entry)
                self._lock.notify()
            else:
                self.lost += 1
        return True

    def hide(self, secret: str) -> None:
        """Leave a text, such as the token, out of every entry, also out of notes."""
        with self._lock:
            self._hidden = (*self._hidden, secret)

    def entries(self) -> Sequence[Entry]:
        """Return the newest entries, the oldest first."""
        with self._lock:
            return tuple(self._shown)

    def since(self, total: int) -> Sequence[Entry]:
        """Return the entries that were added after ``total`` had a value."""
        with self._lock:
            newest = islice(reversed(self._shown), self.total - total)
            return tuple(newest)[::-1]

    # The writer.

    def begin(self, folder: Path) -> None:
        """Write from now on, into a folder; what was noted before is written too."""
        with self._lock:
            if self._thread is not None:
                return
            self._ending = False
            # The files have the rest, if this process began before.
            self._shown = deque(self._queue, MOST_SHOWN)
            self._thread = threading.Thread(
                target=self._write, args=(folder,), name="webmap-shift-log", daemon=True
            )
            self._thread.start()

    def end(self) -> None:
        """Write what waits and end the thread; a disk that hangs is not waited for."""
        with self._lock:
            thread, self._thread = self._thread, None
            self._ending = True
            self._lock.notify()
        if thread is not None:
            thread.join(_GOODBYE_S)

    def _write(self, folder: Path) -> None:
        self._show_earlier(folder)
        files = LogFiles(folder)
        while True:
            with self._lock:
                self._lock.wait_for(lambda: self._queue or self._ending)
                if not self._queue:
                    break
                entry, is_last = self._queue[0], len(self._queue) == 1
            try:
                files.write(msgspec.json.encode(entry) + b"\n", time.time())
                if is_last:
                    files.sync()
            except Exception as error:  # a full disk must not end the thread
                self._failed(folder, error)
                with self._lock:
                    if self._lock.wait_for(lambda: self._ending, RETRY):
                        break
                continue
            with self._lock:
                self._queue.popleft()
                was, self.trouble = self.trouble, ""
            if was:
                self.note("log", f"{was} Missing entries: {self.lost}")
        files.close()

    def _failed(self, folder: Path, error: Exception) -> None:
        why = getattr(error, "strerror", None) or str(error)
        sentence = one_line(f"The log could not be written: {why}.")
        if sentence != self.trouble:
            self.trouble = sentence
            log.error("%s: %s", folder, sentence)

    def _show_earlier(self, folder: Path) -> None:
        try:
            earlier = read_newest(folder, MOST_SHOWN)
        except Exception as error:
            log.warning("the shift log cannot be read: %s", error)
            return
        with self._lock:
            own = tuple(self._shown)
            self._shown.clear()
            self._shown.extend((*earlier, *own))
            self.restored = len(earlier)

    def _plain(self, text: str, longest: int) -> str:
        for secret in self._hidden:
            text = text.replace(secret, "...")
        return one_line(_SECRETS.sub("...", text), longest)

    def _fact(self, value: object) -> Fact:
        if value is None or isinstance(value, bool | int):
            return value
        if isinstance(value, float):
            return round(value, 3) if math.isfinite(value) else None
        return self._plain(str(value), MOST_FACT)


def _utc(unix: float) -> str:
    when = datetime.fromtimestamp(unix, UTC)
    return when.isoformat(timespec="milliseconds").replace("+00:00", "Z")


shift_log = ShiftLog()
"""The shift log of this process."""
