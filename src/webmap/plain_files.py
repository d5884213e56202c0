"""Reading files that people name: whole, small enough, and nothing but files."""

import os
import stat
from pathlib import Path

from webmap.errors import ConfigError


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
    number = os.open(file, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    mode = os.fstat(number).st_mode
    if not stat.S_ISREG(mode):
        os.close(number)
        raise ConfigError(f"{file}: expected a file, got {_kind(mode)}")
    with open(number, "rb") as stream:
        data = stream.read(largest + 1)
    if len(data) > largest:
        raise ConfigError(f"{file}: the file is larger than {largest >> 20} MiB")
    return data


def _kind(mode: int) -> str:
    if stat.S_ISDIR(mode):
        return "a folder"
    return "a pipe" if stat.S_ISFIFO(mode) else "a device"
