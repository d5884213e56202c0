"""One file for each machine: who on this computer has it, and was it being driven?

The operating system lets go of a lock when its process ends, however it ends. What
stands in the file stays: its first letter says whether the machine was being driven.
"""

import logging
import os
import sys
from pathlib import Path

from webmap.gate.events import Key, LockState
from webmap.gate.kept.records import path_of

log = logging.getLogger("webmap.gate")

_RESTS, _DRIVEN = b"0", b"1"

# Windows lets nobody else read a locked byte, so the lock lies beyond the text.
_LOCKED_BYTE = 1 << 20


def state_folder() -> Path:
    """Return the folder for what must outlive the process.

    ``WEBMAP_STATE_DIR`` names it; else it is where the system keeps such things.
    """
    given = os.environ.get("WEBMAP_STATE_DIR")
    if given:
        return Path(given)
    from platformdirs import user_state_dir

    return Path(user_state_dir("webmap"))


class Locks:
    """The machines that this gate alone on this computer may move.

    Args:
        folder: Where the files are.

    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._held: dict[Key, int] = {}

    def acquire(self, key: Key) -> LockState:
        """Try to have a machine."""
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            file = os.open(self._path(key), os.O_RDWR | os.O_CREAT, 0o600)
        except OSError as error:
            why = f"{self._folder} cannot be written to ({error.strerror})"
            return LockState(key, held=False, why=why)
        if not _try_lock(file):
            os.close(file)
            why = self._why_not(key)
            return LockState(key, held=False, why=why, elsewhere=True)
        self._held[key] = file
        return LockState(key, held=True, driven=_was_driven(file, key))

    def release(self, key: Key) -> None:
        """Let others have a machine."""
        file = self._held.pop(key, None)
        if file is not None:
            os.close(file)

    def mark(self, key: Key, driven: bool) -> None:
        """Keep on disk whether a machine is being driven."""
        file = self._held.get(key)
        if file is None:
            return
        try:
            os.lseek(file, 0, os.SEEK_SET)
            os.write(file, _DRIVEN if driven else _RESTS)
        except OSError as error:  # a full disk never stands in the way of a stop
            log.warning("%s: %s", self._path(key), error.strerror)

    def _why_not(self, key: Key) -> str:
        path = self._path(key)
        for other in self._held:
            if self._path(other) == path:
                return f"it is driven as {other.topic} of {other.url} here"
        return "another WebMap on this computer has it"

    def _path(self, key: Key) -> Path:
        return path_of(self._folder, key, "lock")


def _was_driven(file: int, key: Key) -> bool:
    """Return what the file says; one that says nothing clear means yes."""
    try:
        text = os.read(file, 1)
        if text:
            return text != _RESTS
        os.write(file, _RESTS + f" {key.url} {key.topic}\n".encode())
    except OSError:
        return True
    return False


if sys.platform == "win32":
    import msvcrt

    def _try_lock(file: int) -> bool:
        os.lseek(file, _LOCKED_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        os.lseek(file, 0, os.SEEK_SET)
        return True

else:
    import fcntl

    def _try_lock(file: int) -> bool:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
        return True
