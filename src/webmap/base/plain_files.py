"""Reading of files that people name, and writing of whole files."""

import errno
import os
import secrets
import stat
from pathlib import Path

from webmap.base.errors import ConfigError

LARGEST_STATE = 16 << 20
"""Most bytes of a file that WebMap keeps for itself."""

_NO_LINK = getattr(os, "O_NOFOLLOW", 0)


def read_file(file: Path, largest: int, *, links: bool = True) -> bytes:
    """Return the content of a file.

    A file that is not regular is refused before it is read: reading a pipe could block
    for ever, and a device may have no end.

    Args:
        file: The file, or a link to one.
        largest: The most bytes of the file.
        links: Whether the file may be a symbolic link. A file that WebMap keeps for
            itself may not: somebody else made the link.

    Raises:
        ConfigError: If the file is not regular, or larger.
        OSError: If the file cannot be read.

    """
    number = open_regular(file, os.O_RDONLY, links=links)
    with open(number, "rb") as stream:
        data = stream.read(largest + 1)
    if len(data) > largest:
        size = f"{largest >> 10} KiB" if largest < 1 << 20 else f"{largest >> 20} MiB"
        raise ConfigError(f"{file}: the file is larger than {size}")
    return data


def open_regular(file: Path, flags: int, *, links: bool = False) -> int:
    """Open a regular file, and return its descriptor.

    Args:
        file: The file.
        flags: As for ``os.open``; a new file can be read by its owner only.
        links: Whether the file may be a symbolic link.

    Raises:
        ConfigError: If it is not a regular file, or the text is not a path.
        OSError: If it cannot be opened, for example because it is a link.

    """
    # Opened without blocking and checked afterwards, so that the file cannot be
    # replaced between the two.
    flags |= getattr(os, "O_NONBLOCK", 0)
    try:
        number = os.open(file, flags if links else flags | _NO_LINK, 0o600)
    except ValueError:
        raise _no_path(file) from None
    mode = os.fstat(number).st_mode
    if not stat.S_ISREG(mode):
        os.close(number)
        raise ConfigError(f"{file}: expected a file, got {_kind(mode)}")
    return number


def resolved(path: Path) -> Path:
    """Return an absolute path without symbolic links.

    Raises:
        ConfigError: If the links form a circle, or the text is not a path.

    """
    try:
        path.stat()
    except ValueError:
        raise _no_path(path) from None
    except OSError as error:  # a path that leads nowhere is an absolute path, too
        if error.errno == errno.ELOOP:
            raise ConfigError(
                f"{path}: the symbolic links lead in a circle; expected a file"
            ) from None
    return path.resolve()


def refuse_special(path: Path) -> None:
    """Refuse a pipe, a device or a socket, on which a reader may block for ever.

    Raises:
        ConfigError: If the path leads to one of them.
        OSError: If the path leads nowhere.

    """
    mode = path.stat().st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        raise ConfigError(f"{path}: expected a file or a folder, got {_kind(mode)}")


def write_file(file: Path, data: bytes) -> None:
    """Replace the content of a file, or leave the file as it was.

    Several writers may write one file at once: it then holds all that one of them
    wrote. Only the owner can read it. A link at that place is replaced, not followed.

    Args:
        file: The file; its folder is created if missing, for the owner alone.
        data: The new content.

    Raises:
        OSError: If the disk does not accept the data.

    """
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    # A unique name: else one writer could publish the unfinished file of another.
    temporary = file.with_name(f".{file.name}.{secrets.token_hex(8)}.new")
    try:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
        with open(open_regular(temporary, flags), "wb") as stream:
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
    return ConfigError(f"{str(path)!r} is not a path: expected a text without a NUL")
