"""What must outlive the process, one small file for each thing and machine.

A file whose name ends in ``.stop`` means that STOP stands for the machine, whatever is
in it: it tells who said so, but one that is empty or cannot be read stops as well.
"""

import contextlib
import hashlib
import json
import logging
import math
import os
from pathlib import Path
from typing import Any

from webmap.gate.events import MAX_ID, Key, Press, StopRecord
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
