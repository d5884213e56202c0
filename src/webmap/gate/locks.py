"""One lock file for each machine: which process has it, and was it being driven?

The operating system releases a lock when its process ends, however it ends. The content
of the file stays: its first character is 1 if the machine was being driven.
"""

import logging
import os
import sys
import time
from pathlib import Path

from webmap.base.errors import ConfigError
from webmap.base.plain_files import open_regular
from webmap.gate.disk import path_of
from webmap.gate.events import Key, LockState

log = logging.getLogger("webmap.gate")

_RESTS, _DRIVEN = b"0", b"1"

TRIES, PAUSE = 2, 0.002
"""How many times a lock is tried, and the seconds between."""

# On Windows no other process can read a locked byte: lock one beyond the text.
_LOCKED_BYTE = 1 << 20


def state_folder() -> Path:
    """Return the folder for the files that outlive the process.

    ``WEBMAP_STATE_DIR`` names it; otherwise it is the system's folder for user state.
    """
    given = os.environ.get("WEBMAP_STATE_DIR")
    if given:
        return Path(given)
    from platformdirs import user_state_dir

    return Path(user_state_dir("webmap"))


def keep_private(folder: Path) -> None:
    """Create the folder if missing, and let only its owner use it.

    The folder of an earlier version may have wider rights. Everybody who may write
    into it may end a STOP.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if sys.platform == "win32":
            return
        found = folder.stat()
        if found.st_uid != os.geteuid():
            log.warning("%s belongs to another user, who can end every STOP", folder)
        elif found.st_mode & 0o077:
            folder.chmod(0o700)
    except OSError as error:  # each file is still tried
        log.warning("%s: %s", folder, error.strerror)


class Locks:
    """The machines that only this gate, of all on this computer, may move.

    Args:
        folder: Where the files are.

    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._held: dict[Key, int] = {}

    def acquire(self, key: Key) -> LockState:
        """Lock a machine; the answer has the reason if another gate has it."""
        try:
            self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            file = open_locked(self._path(key))
        except ConfigError as error:
            return LockState(key, held=False, why=str(error))
        except OSError as error:
            why = f"{self._folder} cannot be written to ({error.strerror})"
            return LockState(key, held=False, why=why)
        if file is None:
            why = self._why_not(key)
            return LockState(key, held=False, why=why, elsewhere=True)
        self._held[key] = file
        return LockState(key, held=True, driven=_was_driven(file, key))

    def tidy(self) -> None:
        """Remove the files of machines that no gate has and that were not driven.

        Such a file has nothing that a new one would not have. Each port of a bridge
        makes another file, so they would accumulate.
        """
        for path in self._folder.glob("*.lock"):
            try:
                file = open_regular(path, os.O_RDWR)
            except (OSError, ConfigError):
                continue  # it was removed, belongs to another user, or is no file
            try:
                # Another gate may have removed and recreated the file meanwhile.
                is_ours = _try_lock(file) and _is_at(file, path)
                if is_ours and os.read(file, 1) == _RESTS:
                    path.unlink()
            except OSError as error:
                log.debug("%s is left: %s", path, error.strerror)
            finally:
                os.close(file)

    def release(self, key: Key) -> None:
        """Unlock a machine; no effect if this gate does not have its lock."""
        file = self._held.pop(key, None)
        if file is not None:
            os.close(file)

    def mark(self, key: Key, driven: bool) -> None:
        """Write to the file whether a machine is being driven."""
        file = self._held.get(key)
        if file is None:
            return
        try:
            os.lseek(file, 0, os.SEEK_SET)
            os.write(file, _DRIVEN if driven else _RESTS)
        except OSError as error:  # a full disk must not prevent a stop
            log.warning("%s: %s", self._path(key), error.strerror)

    def _why_not(self, key: Key) -> str:
        path = self._path(key)
        for other in self._held:
            if self._path(other) == path:
                return f"this WebMap already uses it as {other.topic} of {other.url}"
        return "another WebMap on this computer uses this robot"

    def _path(self, key: Key) -> Path:
        return path_of(self._folder, key, "lock")


def open_locked(path: Path) -> int | None:
    """Open or create a file and lock it; None if another process has the lock.

    Another process may lock it for a moment and remove it, see :meth:`Locks.tidy`.
    """
    for left in reversed(range(TRIES)):
        file = open_regular(path, os.O_RDWR | os.O_CREAT)
        if _try_lock(file) and _is_at(file, path):
            return file
        os.close(file)
        if left:
            time.sleep(PAUSE)
    return None


def _is_at(file: int, path: Path) -> bool:
    """Return whether an open file is still the file at ``path``."""
    try:
        return os.path.samestat(os.fstat(file), path.lstat())
    except FileNotFoundError:
        return False


def _was_driven(file: int, key: Key) -> bool:
    """Return whether the file has the driven mark; an unclear mark counts as driven."""
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
