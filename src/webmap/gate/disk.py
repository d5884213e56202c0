"""The files that outlive the gate: active STOPs, driven marks and stop test results.

A file whose name ends in ``.stop`` means that STOP stands for the machine, whatever is
in it: it tells who said so, but one that is empty or cannot be read stops as well.

A disk may take a second to say that it has something; a robot that is to be stopped
meanwhile cannot wait for that. So a thread does it, one thing after the other, and an
event tells when it is done.
"""

import asyncio
import contextlib
import dataclasses
import datetime
import hashlib
import json
import logging
import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from webmap.gate.actions import SaveStop, SaveStopTest
from webmap.gate.commands import MAX_ID
from webmap.gate.events import (
    Event,
    Key,
    LockState,
    Press,
    StopFileChanged,
    StopRecord,
    StopSaved,
    StopTestSaved,
)
from webmap.ros.names import spellings_of

log = logging.getLogger("webmap.gate")

UNKNOWN = "an earlier session"
"""Whose STOP it is if the file does not tell."""

MAX_NAME = 80
"""The longest name that is kept, in characters."""


def path_of(folder: Path, key: Key, kind: str) -> Path:
    """Return the file of one machine for one kind of thing.

    However this computer is spelled, it is the same: nobody has a machine twice.
    """
    return _paths_of(folder, key, kind)[0]


def _paths_of(folder: Path, key: Key, kind: str) -> list[Path]:
    """Return the file, and where it was when each spelling had its own."""
    keys = [key._replace(url=url) for url in spellings_of(key.url)]
    names = [hashlib.sha256("\n".join(k).encode()).hexdigest()[:24] for k in keys]
    return [folder / f"{name}.{kind}" for name in names]


def _found(folder: Path, key: Key, kind: str) -> Path:
    """Return the file that there is, or else where it would be."""
    paths = _paths_of(folder, key, kind)
    # One that was being lifted when a gate died has not been lifted.
    return next(filter(os.path.lexists, [*paths, *map(_aside, paths)]), paths[0])


def _aside(path: Path) -> Path:
    return path.with_suffix(f"{path.suffix}.lifted")


class Records:
    """The files of one folder.

    Args:
        folder: Where the files are.

    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def latch_of(self, key: Key) -> Press | None:
        """Return the STOP that stands for a machine, if one does."""
        return _press_in(_found(self._folder, key, "stop"))

    def stamp_of(self, key: Key) -> tuple[int, int] | None:
        """Return what changes with the file of a STOP; ``None`` if there is none."""
        return _stamp(_found(self._folder, key, "stop"))

    def keep_latch(
        self, key: Key, press: Press | None, ids: frozenset[str]
    ) -> str | None:
        """Have STOP stand on disk, or not; return what went wrong, in words.

        When this returns, the disk has it: the file and its place in the folder.

        Args:
            key: The machine.
            press: The STOP; ``None`` if it stands no longer.
            ids: The STOPs that this gate may have left in the file. A file with
                another one is of another gate, and is not taken away.

        """
        path, *others = _paths_of(self._folder, key, "stop")
        try:
            if press is None:
                for each in (path, *others):
                    _lift(each, ids)
                _flush_folder(self._folder)
            else:
                who = {"by": press.by, "id": press.id}
                self._write(path, {**who, "bridge": key.url, "topic": key.topic})
                for each in others:  # or it would be found when this one is lifted
                    each.unlink(missing_ok=True)
        except OSError as error:
            log.error("%s: %s", path, error)
            return f"{path} cannot be written to ({error.strerror})"
        return None

    def stop_test_of(self, key: Key) -> StopRecord | None:
        """Return what the last stop test of a machine found, if there was one."""
        path = _found(self._folder, key, "test")
        try:
            found = json.loads(path.read_text("utf-8"))
            seconds, date = found["seconds"], found["date"]
            if seconds is not None:
                seconds = float(seconds)
            if not isinstance(date, str) or (seconds is not None and _odd(seconds)):
                raise ValueError("invalid values")
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
            log.warning("%s cannot be read (%s): no stop test known", path, error)
            return None
        return StopRecord(seconds, date[:MAX_NAME])

    def keep_stop_test(self, key: Key, record: StopRecord) -> None:
        """Keep what a stop test found."""
        path = path_of(self._folder, key, "test")
        found = {"seconds": record.seconds, "date": record.date}
        try:
            self._write(path, {**found, "bridge": key.url, "topic": key.topic})
        except OSError as error:
            log.error("%s: %s", path, error)

    def _write(self, path: Path, content: dict[str, Any]) -> None:
        """Write a file so that after a crash it is whole, old or new."""
        self._folder.mkdir(parents=True, exist_ok=True)
        temporary = path.with_suffix(f"{path.suffix}.new")
        with temporary.open("w", encoding="utf-8") as file:
            json.dump(content, file)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
        _flush_folder(self._folder)


def _press_in(path: Path) -> Press | None:
    """Return the STOP that a file tells of; ``None`` if there is no such file."""
    try:
        found = json.loads(path.read_text("utf-8"))
        by, id = found["by"], found.get("id")
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        log.warning("%s cannot be read (%s): STOP is active", path, error)
        by = id = None
    if not (isinstance(by, str) and by and by.isprintable()):
        by = UNKNOWN
    if not (isinstance(id, str) and id and id.isprintable() and len(id) <= MAX_ID):
        # Earlier versions wrote none. This one changes when they write the file anew.
        id = "file-" + "-".join(f"{part:x}" for part in _stamp(path) or (0,))
    return Press(by[:MAX_NAME], id)


def _stamp(path: Path) -> tuple[int, int] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_ino


def _lift(path: Path, ids: frozenset[str]) -> None:
    """Take the file of a STOP away, unless it tells of another one than these."""
    aside = _aside(path)
    with contextlib.suppress(FileNotFoundError):
        path.replace(aside)  # from here on nobody else changes it
    press = _press_in(aside)
    if press is None:
        return
    if press.id in ids:
        aside.unlink()
    else:
        aside.replace(path)


def _odd(seconds: float) -> bool:
    return not (math.isfinite(seconds) and seconds >= 0)


def _flush_folder(folder: Path) -> None:
    """Have the disk know which files there are; not every system lets us ask."""
    if os.name == "nt":
        return
    file = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        with contextlib.suppress(OSError):
            os.close(file)


class Disk:
    """Does what the decisions ask for on the disk.

    Args:
        records: The files.

    """

    def __init__(self, records: Records) -> None:
        self._records = records
        self._thread = ThreadPoolExecutor(1, "gate-disk")
        self._under_way: set[asyncio.Future[Event]] = set()
        self._stamps: dict[Key, tuple[int, int] | None] = {}

    def recall(self, state: LockState) -> LockState:
        """Return ``state`` with what is known of its machine from before."""
        # Asked for again and again while another gate has the machine.
        if state.key not in self._stamps:
            self._stamps[state.key] = self._records.stamp_of(state.key)
        return dataclasses.replace(
            state,
            latched=self._records.latch_of(state.key),
            tested=self._records.stop_test_of(state.key),
        )

    def forget(self, key: Key) -> None:
        """Look at the files of a machine no longer."""
        self._stamps.pop(key, None)

    async def look(self) -> list[StopFileChanged]:
        """Return the STOPs whose files are others than when they were looked at last.

        In the same thread as :meth:`keep`, so that what was kept before is seen, and
        what is kept after is not.
        """
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._thread, self._look)

    def _look(self) -> list[StopFileChanged]:
        seen = []
        for key, before in list(self._stamps.items()):
            stamp = self._records.stamp_of(key)
            if stamp != before and key in self._stamps:
                self._stamps[key] = stamp
                seen.append(StopFileChanged(key, self._records.latch_of(key)))
        return seen

    def keep(
        self, action: SaveStop | SaveStopTest, tell: Callable[[Event], None]
    ) -> None:
        """Keep something; ``tell`` hears of it when the disk has it."""
        loop = asyncio.get_running_loop()
        work = loop.run_in_executor(self._thread, self._do, action)
        self._under_way.add(work)

        def done(work: asyncio.Future[Event]) -> None:
            self._under_way.discard(work)
            if not work.cancelled():
                tell(work.result())

        work.add_done_callback(done)

    async def settle(self) -> None:
        """Wait until the disk has everything."""
        if self._under_way:
            await asyncio.wait(self._under_way)

    def _do(self, action: SaveStop | SaveStopTest) -> Event:
        if isinstance(action, SaveStop):
            error = self._records.keep_latch(action.key, action.press, action.ids)
            if action.key in self._stamps:
                # What another gate does from here on is news, also what it did while
                # the disk took its time to take the file away.
                stands = action.press is not None
                kept = self._records.stamp_of(action.key) if stands else None
                self._stamps[action.key] = kept
            return StopSaved(action.key, action.number, error)
        today = datetime.datetime.now().astimezone().date().isoformat()
        record = StopRecord(action.seconds, today)
        self._records.keep_stop_test(action.key, record)
        return StopTestSaved(action.key, record)
