"""The thread that writes the ring, and has recordings made of it."""

import contextlib
import logging
import os
import shutil
import subprocess
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from queue import Full, Queue

from webmap.bags import need_rosbags
from webmap.bags.ring import BUSY, SPARE, Frame, Ring
from webmap.base.errors import ConfigError
from webmap.base.processes import python_command
from webmap.base.text import counted, one_line
from webmap.gate.locks import open_locked, state_folder

log = logging.getLogger("webmap.incidents")

WAITING = 120
"""Handed over records that may wait, about one for each second; more are dropped."""

MOST_FILES = 20
"""Most recordings that are kept by themselves, and as many that people asked for."""

MOST_BYTES = 1 << 30
"""Most bytes of each of the two kinds of recordings."""

LONGEST = 600.0
"""Seconds after which the making of a recording is given up."""

SLOW = "Some of the last minutes are missing: the disk is too slow."

RINGS = 8
"""Most processes with one state folder that record at the same time."""

ASKED, ITSELF = "asked", "auto"
"""The last part of the name of a recording: whether a person asked for it."""


@dataclass(frozen=True, slots=True)
class Kept:
    """A recording that was kept."""

    path: Path
    text: str
    """Its name and its size, in a sentence."""


def recordings_folder() -> Path:
    """Return the folder of the recordings that are kept."""
    return state_folder() / "recordings"


def _file_of(frozen: Path) -> Path:
    """Return the recording that is made of a frozen ring."""
    return recordings_folder() / frozen.name.removeprefix("keep-")


def recordings(folder: Path, kind: str) -> list[Path]:
    """Return the recordings of one kind, the oldest first."""
    return sorted(folder.glob(f"incident-*-{kind}.mcap"))


def remove_oldest(folder: Path) -> list[Path]:
    """Delete the oldest recordings that nobody asked for, until few enough are left.

    Returns:
        The deleted ones.

    """
    kept = recordings(folder, ITSELF)
    removed = []
    while len(kept) > 1 and (len(kept) > MOST_FILES or _size(kept) > MOST_BYTES):
        oldest = kept.pop(0)
        oldest.unlink(missing_ok=True)
        removed.append(oldest)
    return removed


def why_full(folder: Path) -> str:
    """Return why no more recordings that people ask for are kept, or ""."""
    kept = recordings(folder, ASKED)
    if len(kept) < MOST_FILES and _size(kept) < MOST_BYTES:
        return ""
    return (
        f"there are {counted(len(kept), 'recording')} that people asked for, with "
        f"{_size(kept) / 1e6:.0f} MB, in {folder}: move or delete some of them"
    )


def _size(files: Sequence[Path]) -> int:
    total = 0
    for file in files:
        with contextlib.suppress(OSError):
            total += file.stat().st_size
    return total


class IncidentWriter:
    """Writes records to the disk in a thread of its own; nothing here raises."""

    def __init__(self) -> None:
        self.trouble = ""
        """Why nothing is recorded or kept, as a sentence; empty if all is well."""
        self.kept: Kept | None = None
        """The newest recording."""
        self.is_busy = False
        """Whether a recording is made now."""
        self.left: subprocess.Popen[bytes] | None = None
        """A process that makes a recording when this one has ended."""
        self._is_ending = False
        self._waiting: Queue[list[Frame] | str | None] = Queue(WAITING)
        self._one_at_a_time = threading.Lock()
        self._ring: Ring | None = None
        self._folder: Path | None = None
        self._lock: int | None = None
        self._thread = threading.Thread(target=self._run, name="incidents", daemon=True)

    def start(self) -> None:
        """Begin to write."""
        self._thread.start()

    def put(self, frames: list[Frame]) -> None:
        """Write frames soon; they are dropped if too many wait."""
        try:
            self._waiting.put_nowait(frames)
        except Full:
            self.trouble = self.trouble or SLOW

    def keep(self, asked: bool) -> None:
        """Make a recording of all that was put until now."""
        self.is_busy = True
        try:
            self._waiting.put_nowait(ASKED if asked else ITSELF)
        except Full:
            self.is_busy = False
            self._complain("The last minutes were not kept: the disk is too slow")

    def finish(self, seconds: float = 5.0) -> None:
        """Write what waits, and end the thread; give up after some seconds.

        A recording that is due is made by a process that goes on afterwards.
        """
        self._is_ending = True
        with contextlib.suppress(Full):
            self._waiting.put(None, timeout=seconds)
        self._thread.join(seconds)

    def _run(self) -> None:
        try:
            self._open()
        except (ConfigError, OSError) as error:
            self._complain(f"The last minutes are not recorded: {error}")
            return
        while (what := self._waiting.get()) is not None:
            try:
                if isinstance(what, list):
                    self._write(what)
                else:
                    self._make(what)
            except Exception as error:  # whatever it is, the next minute counts
                self._complain(f"The last minutes are not recorded: {one_line(error)}")
        if self._ring is not None:
            self._ring.close()
        if self._lock is not None:
            os.close(self._lock)

    def _open(self) -> None:
        need_rosbags()
        rings = state_folder() / "incidents"
        for number in range(1, RINGS + 1):
            folder = rings / str(number)
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._lock = open_locked(folder / "lock")
            if self._lock is not None:
                self._folder, self._ring = folder, Ring(folder)
                break
        else:
            raise ConfigError(f"{RINGS} other processes use {rings}")
        for unfinished in folder.glob("keep-*"):  # the computer went down meanwhile
            self._convert(unfinished)

    def _write(self, frames: list[Frame]) -> None:
        assert self._ring is not None
        try:
            self._ring.write(frames, time.monotonic())
        except OSError as error:
            why = error.strerror or str(error)
            self._complain(f"The last minutes are not recorded: {why}")
        else:
            if self.trouble == SLOW or " not recorded" in self.trouble:
                self.trouble = ""

    def _make(self, kind: str) -> None:
        """Freeze the ring, and have a recording made of it in another thread."""
        assert self._ring is not None
        assert self._folder is not None
        full = why_full(recordings_folder()) if kind == ASKED else ""
        if full:
            self.is_busy = False
            self._complain(f"The last minutes were not kept: {full}")
            return
        name = f"incident-{time.strftime('%Y-%m-%d-%H-%M-%S')}-{kind}.mcap"
        frozen = self._folder / f"keep-{name}"
        try:
            self._ring.freeze(frozen)
        except OSError as error:
            self.is_busy = False
            shutil.rmtree(frozen, ignore_errors=True)
            self._complain(f"The last minutes were not kept: {error}")
            return
        self._convert(frozen)

    def _convert(self, frozen: Path) -> None:
        """Have a recording made of the frozen segments in a folder."""
        if self._is_ending:
            none, file = subprocess.DEVNULL, _file_of(frozen)
            command = python_command("webmap.bags.incident", frozen, file)
            self.left = subprocess.Popen(
                command, stdin=none, stdout=none, start_new_session=True
            )
            log.info("the last minutes will be kept in %s", file)
            return
        threading.Thread(
            target=self._wait_for, args=[frozen], name="incident", daemon=True
        ).start()

    def _wait_for(self, frozen: Path) -> None:
        """Wait for the process that makes a recording; one runs at a time."""
        with self._one_at_a_time:
            self.is_busy = True
            try:
                why = self._run_process(frozen, _file_of(frozen))
            except (OSError, subprocess.SubprocessError) as error:
                why = one_line(error)
            if why:
                shutil.rmtree(frozen, ignore_errors=True)
                self._complain(f"The last minutes were not kept: {why}")
            self.is_busy = False

    def _run_process(self, frozen: Path, file: Path) -> str:
        """Make a recording; return why that failed, or ""."""
        folder = file.parent
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if shutil.disk_usage(folder).free < 2 * SPARE:
            return "the disk is nearly full"
        made = subprocess.run(
            python_command("webmap.bags.incident", frozen, file),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            text=True,
            timeout=LONGEST,
            start_new_session=True,
            check=False,
        )
        if made.returncode == BUSY:  # the process of an earlier display makes it
            return ""
        if made.returncode != 0:
            return (
                made.stdout.strip().rpartition("\n")[2] or f"status {made.returncode}"
            )
        self.trouble = ""
        size = file.stat().st_size / 1e6
        self.kept = Kept(file, f"Kept: {file.name} ({size:.1f} MB), in {folder}.")
        log.info("the last minutes are kept in %s (%.1f MB)", file, size)
        for each in remove_oldest(folder):
            log.info("%s was deleted: %d newer ones are kept", each, MOST_FILES)
        return ""

    def _complain(self, text: str) -> None:
        text = f"{text.rstrip('.')}."
        if text != self.trouble:
            log.warning("%s", text)
        self.trouble = text
