"""Files that people name are read, and those of this program written, whole."""

import os
import secrets
import stat
from pathlib import Path

from webmap.base.errors import ConfigError

LARGEST_STATE = 16 << 20
"""Bytes that a file may have which WebMap keeps for itself."""


def read_file(file: Path, largest: int) -> bytes:
    """Return what is in a file.

    What is no regular file is refused before a byte of it is read: a pipe would be
    waited for without an end, and a device may have none.

    Args:
        file: The file, or a link to one.
        largest: The most bytes that it may have.

    Raises:
        ConfigError: If it is no regular file, or larger.
        OSError: If it cannot be read.

    """
    # Opened without waiting for anybody at the other end, and then looked at, so that
    # nothing can be put in its place between the two.
    try:
        number = os.open(file, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    except ValueError:
        raise _no_path(file) from None
    mode = os.fstat(number).st_mode
    if not stat.S_ISREG(mode):
        os.close(number)
        raise ConfigError(f"{file}: expected a file, got {_kind(mode)}")
    with open(number, "rb") as stream:
        data = stream.read(largest + 1)
    if len(data) > largest:
        size = f"{largest >> 10} KiB" if largest < 1 << 20 else f"{largest >> 20} MiB"
        raise ConfigError(f"{file}: the file is larger than {size}")
    return data


def resolved(path: Path) -> Path:
    """Return an absolute path without symbolic links.

    Raises:
        ConfigError: If the links lead in a circle, or the text is no path.

    """
    try:
        return path.resolve()
    except RuntimeError:  # up to Python 3.12; later versions leave it to the open
        raise ConfigError(
            f"{path}: the symbolic links lead in a circle; expected a file"
        ) from None
    except ValueError:
        raise _no_path(path) from None


def refuse_special(path: Path) -> None:
    """Refuse a pipe, a device or a socket, which a reader may wait for without end.

    Raises:
        ConfigError: If the path leads to one of them.
        OSError: If the path leads nowhere.

    """
    mode = path.stat().st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        raise ConfigError(f"{path}: expected a file or a folder, got {_kind(mode)}")


def write_file(file: Path, data: bytes) -> None:
    """Put bytes in the place of a file, or leave it as it was.

    Several may write one file at once: it holds all that one of them wrote.

    Args:
        file: The file; its folder is made if there is none.
        data: All that is to be in it.

    Raises:
        OSError: If the disk does not take them.

    """
    file.parent.mkdir(parents=True, exist_ok=True)
    # A name that nobody else has, or one would put there what another still writes.
    temporary = file.with_name(f".{file.name}.{secrets.token_hex(8)}.new")
    try:
        with temporary.open("xb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(file)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _kind(mode: int) -> str:
    if stat.S_ISDIR(mode):
        return "a folder"
    if stat.S_ISSOCK(mode):
        return "a socket"
    return "a pipe" if stat.S_ISFIFO(mode) else "a device"


def _no_path(path: Path) -> ConfigError:
    return ConfigError(f"{str(path)!r} is no path: expected a text without a NUL")
