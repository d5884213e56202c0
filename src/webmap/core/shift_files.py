"""The files of the shift log: JSON lines, of limited size, age and number.

Each process writes files of its own and only appends to them, so that several processes
of one user share the folder.
"""

import errno
import os
import secrets
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeAlias

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.plain_files import open_regular, read_file

FOLDER = "shift-log"
"""The folder in the folder for state."""

LARGEST_FILE = 2 << 20
"""Bytes after which another file is begun."""

LONGEST_FILE = 24 * 3600.0
"""Seconds after which another file is begun."""

LARGEST = 64 << 20
"""Bytes of all files together; the oldest are removed."""

OLDEST = 90 * 24 * 3600.0
"""Seconds after its last line when a file is removed."""

MOST_FILES = 1000


Fact: TypeAlias = str | int | float | bool | None


class Entry(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One line of the log."""

    time: str
    """In UTC, such as ``2026-11-29T08:14:02.113Z``."""
    unix: float
    """The same time in seconds since 1970."""
    kind: str
    """What happened: such as ``"stop"``."""
    text: str
    robot: str = ""
    """The id of the robot, if the entry is about one."""
    robot_name: str = ""
    person: str = ""
    """Who did it: a person, a program, or nobody."""
    verified: bool | None = None
    """Whether a sign-in has verified the name; None for a program."""
    place: str = ""
    facts: dict[str, Fact] = {}


class Bounds:
    """Decides when a file ends and which files are removed. No I/O and no clock."""

    def __init__(self) -> None:
        self.size = 0
        """Bytes of the present file."""
        self.began: float | None = None
        """When the present file was begun; None if there is none."""

    def name(self, now: float) -> str:
        """Return the name of a new file, which sorts by time."""
        stamp = datetime.fromtimestamp(now, UTC).strftime("%Y%m%dT%H%M%SZ")
        return f"{stamp}-{secrets.token_hex(4)}.jsonl"

    def is_over(self, more: int, now: float) -> bool:
        """Return whether ``more`` bytes belong into another file."""
        if self.began is None:
            return True
        full = self.size > 0 and self.size + more > LARGEST_FILE
        return full or not 0 <= now - self.began < LONGEST_FILE

    def surplus(self, files: Sequence[tuple[str, int, float]], now: float) -> list[str]:
        """Return which files to remove.

        Args:
            files: The name, the size and the time of the last change of each file.
            now: Seconds since 1970.

        """
        removed, kept = [], 0
        for number, (name, size, changed) in enumerate(sorted(files, reverse=True)):
            kept += size
            too_many = number >= MOST_FILES or kept > LARGEST - LARGEST_FILE
            if too_many or now - changed > OLDEST:
                removed.append(name)
        return removed


class LogFiles:
    """Writes lines into the files of a folder.

    Args:
        folder: The folder, made if missing.

    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._bounds = Bounds()
        self._file: Path | None = None
        self._number = -1

    def write(self, line: bytes, now: float) -> None:
        """Append a line, in another file if the present one is full or old.

        Raises:
            OSError: If the disk does not accept it; the next line then goes to another
                file, because this one may end with a part of a line.

        """
        if self._bounds.is_over(len(line), now):
            self._begin(now)
        try:
            if os.write(self._number, line) != len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except BaseException:
            self.close()
            raise
        self._bounds.size += len(line)

    def sync(self) -> None:
        """Wait until the disk has the lines.

        Raises:
            OSError: If the disk does not accept them.

        """
        if self._file is not None:
            os.fsync(self._number)

    def close(self) -> None:
        """Close the present file; remove it if it has no line."""
        file, self._file, self._bounds.began = self._file, None, None
        if file is not None:
            os.close(self._number)
            if self._bounds.size == 0:
                file.unlink(missing_ok=True)

    def _begin(self, now: float) -> None:
        self.close()
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        for name in self._bounds.surplus(_listed(self.folder), now):
            (self.folder / name).unlink(missing_ok=True)
        file = self.folder / self._bounds.name(now)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND
        self._number = open_regular(file, flags)
        self._file = file
        self._bounds.size, self._bounds.began = 0, now


def _listed(folder: Path) -> list[tuple[str, int, float]]:
    found = []
    for file in folder.glob("*.jsonl"):
        try:
            stat = file.lstat()
        except FileNotFoundError:
            continue  # another process removed it
        found.append((file.name, stat.st_size, stat.st_mtime))
    return found


def read_newest(folder: Path, most: int, since: float = 0.0) -> list[Entry]:
    """Return the newest lines of all files, the oldest first.

    Lines and files that cannot be read are left out: another process may be writing,
    and a disk may have been full.

    Args:
        folder: The folder.
        most: The greatest number of lines.
        since: Seconds since 1970; files that ended before are not read.

    """
    decode = msgspec.json.Decoder(Entry).decode
    found: list[Entry] = []
    for name, _, changed in sorted(_listed(folder), reverse=True):
        if len(found) >= most or changed < since:
            continue
        try:
            data = read_file(folder / name, 4 * LARGEST_FILE, links=False)
        except (OSError, ConfigError):
            continue
        for line in data.splitlines():
            try:
                found.append(decode(line))
            except (msgspec.DecodeError, UnicodeDecodeError):
                continue
        time.sleep(0)  # other threads of the process run between two files
    found.sort(key=lambda entry: entry.unix)
    return found[-most:]
