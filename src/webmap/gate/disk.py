"""The files that outlive the gate: active STOPs and stop test results.

An entry whose name ends in ``.stop`` means that STOP is active for the machine,
whatever it is: a file with the name of who pressed STOP, an empty or unreadable file, a
pipe, a folder, or a link, also one that leads nowhere. Whoever made it may have meant a
STOP, and a person can reset it. Only a regular file is read, up to :data:`LARGEST`.

A disk may take a second to confirm a write, and a robot that must stop meanwhile cannot
wait for that. So a thread writes one file after the other, and an event reports when
each is on disk.
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
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec

from webmap.base.plain_files import read_file, write_file
from webmap.gate.actions import SaveCheck, SaveStop, SaveStopTest
from webmap.gate.commands import MAX_ID
from webmap.gate.events import (
    CheckRecord,
    CheckSaved,
    Event,
    Key,
    LockState,
    Press,
    StopFileChanged,
    StopRecord,
    StopSaved,
    StopTestSaved,
)
from webmap.gate.protocol import Identity
from webmap.ros.names import spellings_of

log = logging.getLogger("webmap.gate")

UNKNOWN = "an earlier session"
"""Who pressed STOP if the file does not contain it."""

LARGEST = 1 << 16
"""Most bytes of a file."""

Stamp = tuple[int, int]

UNSEEN: Stamp = (0, 0)
"""The stamp of a file that the next check reports in any case."""

MAX_NAME = 80
"""The longest name of a person or page that is kept, in characters."""


def path_of(folder: Path, key: Key, kind: str) -> Path:
    """Return the file of one machine for one kind of record.

    All spellings of this computer's address give the same file: otherwise two gates
    could each have the same machine.
    """
    return _paths_of(folder, key, kind)[0]


def _paths_of(folder: Path, key: Key, kind: str) -> list[Path]:
    """Return the file, then its former paths, when each spelling had its own file."""
    return [folder / f"{name}.{kind}" for name in _names_of(key)]


@lru_cache(maxsize=1 << 14)
def _names_of(key: Key) -> tuple[str, ...]:
    """Return the names of a machine's files, without the kind, one per spelling."""
    keys = [key._replace(url=url) for url in spellings_of(key.url)]
    return tuple(hashlib.sha256("\n".join(k).encode()).hexdigest()[:24] for k in keys)


@lru_cache(maxsize=1 << 14)
def _stops_of(key: Key) -> tuple[str, ...]:
    """Return the names of the files where a STOP may be, in the order to look."""
    stops = [f"{name}.stop" for name in _names_of(key)]
    # A STOP that was being lifted when a gate died has not been lifted. Another gate
    # may move it aside and back meanwhile, so the first ones are looked at again.
    return (*stops, *(_aside(Path(stop)).name for stop in stops), *stops)


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
        """Return the active STOP of a machine, if there is one."""
        found = map(_press_in, map(self._folder.joinpath, _stops_of(key)))
        return next((press for press in found if press is not None), None)

    def changed(self, stamps: Mapping[Key, Stamp | None]) -> list[Key]:
        """Return whose STOP file may have another stamp now, by one listing."""
        listed: dict[str, Stamp | None] = {}
        try:
            for name in os.listdir(self._folder):
                if ".stop" in name:
                    listed[name] = _stamp(self._folder / name)
        except OSError:  # each file may be there nevertheless
            return list(stamps)
        if not listed:
            return [key for key, stamp in stamps.items() if stamp is not None]
        found = {
            key: next(filter(None, map(listed.get, _stops_of(key))), None)
            for key in stamps
        }
        return [key for key in stamps if found[key] != stamps[key]]

    def stamp_of(self, key: Key) -> Stamp | None:
        """Return a value that changes with the STOP file; ``None`` without a file."""
        found = map(_stamp, map(self._folder.joinpath, _stops_of(key)))
        return next((stamp for stamp in found if stamp is not None), None)

    def keep_latch(
        self, key: Key, press: Press | None, ids: frozenset[str]
    ) -> str | None:
        """Keep a STOP on disk or remove it; return why that failed, if it did.

        When this returns, the disk has both the file and its entry in the folder.

        Args:
            key: The machine.
            press: The STOP; ``None`` if it is not active any more.
            ids: The STOPs that this gate may have left in the file. A file with
                another STOP belongs to another gate and is not removed.

        """
        path, *others = _paths_of(self._folder, key, "stop")
        try:
            if press is None:
                for each in (path, *others):
                    _lift(each, ids)
                _flush_folder(self._folder)
            else:
                who = {"by": press.by, "id": press.id}
                if press.identity is not None:
                    who["identity"] = msgspec.to_builtins(press.identity)
                self._write(path, {**who, "bridge": key.url, "topic": key.topic})
                for each in others:  # otherwise found when this one is lifted
                    each.unlink(missing_ok=True)
        except OSError as error:
            log.error("%s: %s", path, error)
            return f"{path} cannot be written to ({error.strerror})"
        return None

    def stop_test_of(self, key: Key) -> StopRecord | None:
        """Return the result of the last stop test of a machine, if there was one."""
        paths = _paths_of(self._folder, key, "test")
        path = next(filter(os.path.lexists, paths), paths[0])
        try:
            found = json.loads(read_file(path, LARGEST, links=False))
            seconds, date = found["seconds"], found["date"]
            if seconds is not None:
                seconds = float(seconds)
            late = float(found.get("error", 0.0))
            odd = _odd(late) or (seconds is not None and _odd(seconds))
            if odd or not isinstance(date, str):
                raise ValueError("invalid values")
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
            log.warning("%s cannot be read (%s): no stop test known", path, error)
            return None
        return StopRecord(seconds, date[:MAX_NAME], late)

    def keep_stop_test(self, key: Key, record: StopRecord) -> None:
        """Write the result of a stop test to the disk; an error is logged."""
        path = path_of(self._folder, key, "test")
        found = {"seconds": record.seconds, "error": record.error, "date": record.date}
        try:
            self._write(path, {**found, "bridge": key.url, "topic": key.topic})
        except OSError as error:
            log.error("%s: %s", path, error)

    def check_of(self, key: Key) -> CheckRecord | None:
        """Return the newest check of a machine before driving, if there was one."""
        paths = _paths_of(self._folder, key, "check")
        path = next(filter(os.path.lexists, paths), paths[0])
        try:
            found = json.loads(read_file(path, LARGEST, links=False))
            by, at = found["by"], float(found["at"])
            if not isinstance(by, str) or _odd(at):
                raise ValueError("invalid values")
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
            log.warning("%s cannot be read (%s): no check known", path, error)
            return None
        return CheckRecord(by[:MAX_NAME], at, time.time() - at)

    def keep_check(self, key: Key, by: str, at: float) -> None:
        """Write a check before driving to the disk; an error is logged."""
        path = path_of(self._folder, key, "check")
        try:
            who = {"by": by, "at": at, "bridge": key.url, "topic": key.topic}
            self._write(path, who)
        except OSError as error:
            log.error("%s: %s", path, error)

    def _write(self, path: Path, content: dict[str, Any]) -> None:
        """Write a file so that a crash leaves the whole old or the whole new one."""
        write_file(path, json.dumps(content).encode())
        _flush_folder(self._folder)


def _press_in(path: Path) -> Press | None:
    """Return the STOP in a file; ``None`` if there is nothing of that name."""
    try:
        found = json.loads(read_file(path, LARGEST, links=False))
        by, id, identity = found["by"], found.get("id"), found.get("identity")
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        log.warning("%s cannot be read (%s): STOP is active", path, error)
        by = id = identity = None
    if not (isinstance(by, str) and by and by.isprintable()):
        by = UNKNOWN
    if not (isinstance(id, str) and id and id.isprintable() and len(id) <= MAX_ID):
        # Earlier versions wrote no identity. This one changes with each new file.
        id = "file-" + "-".join(f"{part:x}" for part in _stamp(path) or (0,))
    try:
        return Press(by[:MAX_NAME], id, msgspec.convert(identity, Identity | None))
    except msgspec.ValidationError:
        return Press(by[:MAX_NAME], id)


def _stamp(path: Path) -> Stamp | None:
    try:
        found = path.lstat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_ino


def _lift(path: Path, ids: frozenset[str]) -> None:
    """Remove the file of a STOP, unless it has a STOP that is not in ``ids``."""
    aside = _aside(path)
    with contextlib.suppress(FileNotFoundError):
        path.replace(aside)  # from here on no other gate changes it
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
    """Flush the entries of a folder to the disk, on systems that offer it."""
    if os.name == "nt":
        return
    file = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        with contextlib.suppress(OSError):
            os.close(file)


class Disk:
    """Performs the actions of the rules that concern the disk.

    Args:
        records: The files.

    """

    def __init__(self, records: Records) -> None:
        self._records = records
        self._thread = ThreadPoolExecutor(1, "gate-disk")
        self._under_way: set[asyncio.Future[Event]] = set()
        self._stamps: dict[Key, Stamp | None] = {}

    def recall(self, state: LockState) -> LockState:
        """Return ``state`` with the machine's STOP and stop test from the disk."""
        # Called again and again while another gate has the machine.
        if state.key not in self._stamps:
            self._stamps[state.key] = self._records.stamp_of(state.key)
        return dataclasses.replace(
            state,
            latched=self._records.latch_of(state.key),
            tested=self._records.stop_test_of(state.key),
            checked=self._records.check_of(state.key),
        )

    def forget(self, key: Key) -> None:
        """Stop checking the files of a machine."""
        self._stamps.pop(key, None)

    async def check(self) -> list[StopFileChanged]:
        """Return the STOPs whose files have changed since the last check.

        The check runs in the same thread as :meth:`keep`: it sees what was kept
        before it, and nothing that is kept after it.
        """
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._thread, self._changed)

    def _changed(self) -> list[StopFileChanged]:
        seen = []
        stamps = self._stamps.copy()
        for key in self._records.changed(stamps):
            # A listing may miss a file that is being replaced.
            stamp = self._records.stamp_of(key)
            if stamp != stamps[key] and key in self._stamps:
                self._stamps[key] = stamp
                seen.append(StopFileChanged(key, self._records.latch_of(key)))
        return seen

    def keep(
        self, action: SaveStop | SaveStopTest | SaveCheck, emit: Callable[[Event], None]
    ) -> None:
        """Write a record; ``emit`` is called with an event when it is on disk."""
        loop = asyncio.get_running_loop()
        work = loop.run_in_executor(self._thread, self._do, action)
        self._under_way.add(work)

        def done(work: asyncio.Future[Event]) -> None:
            self._under_way.discard(work)
            if not work.cancelled():
                emit(work.result())

        work.add_done_callback(done)

    async def settle(self) -> None:
        """Wait until everything is on disk."""
        if self._under_way:
            await asyncio.wait(self._under_way)

    def _stamp_after(self, action: SaveStop) -> Stamp | None:
        """Return the stamp of the file that this gate has just written.

        Another gate may have replaced or removed the file since, and after a reset
        the rules wait for the result: the next check then reports what is there.
        """
        stamp = self._records.stamp_of(action.key)
        found = self._records.latch_of(action.key)
        is_own = found and action.press and found.id == action.press.id
        return stamp if is_own else UNSEEN

    def _do(self, action: SaveStop | SaveStopTest | SaveCheck) -> Event:
        if isinstance(action, SaveStop):
            error = self._records.keep_latch(action.key, action.press, action.ids)
            if action.key in self._stamps and not (error and action.press):
                self._stamps[action.key] = self._stamp_after(action)
            return StopSaved(action.key, action.number, error)
        if isinstance(action, SaveCheck):
            at = time.time()
            self._records.keep_check(action.key, action.by, at)
            return CheckSaved(action.key, CheckRecord(action.by, at, 0.0))
        today = datetime.datetime.now().astimezone().date().isoformat()
        record = StopRecord(action.seconds, today, action.error)
        self._records.keep_stop_test(action.key, record)
        return StopTestSaved(action.key, record)
