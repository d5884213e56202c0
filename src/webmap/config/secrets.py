"""Detection of passwords in a fleet file that other users of this computer can read."""

import os
import re
import shlex
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, urlsplit

_SECRET = re.compile(
    r"(?i)(?:^|[_-])(?:password|passwd|pwd|pass|secret|token|api[_-]?key|auth|credentials)$"
)


def readable_secret(file: Path, data: Any) -> str | None:
    """Return a warning if a file contains a password and others may read it.

    Args:
        file: The file.
        data: Its content, as plain values.

    Raises:
        OSError: If the file no longer exists.

    """
    mode = file.stat().st_mode & 0o777
    if os.name != "posix" or not mode & 0o077 or not _holds_secret(data):
        return None
    return (
        f"{file} contains a password, and other users of this computer may read it "
        f"(its mode is {mode:04o}): run chmod 600 {shlex.quote(str(file))}"
    )


def _holds_secret(data: Any) -> bool:
    """Return whether a text in the data is a password, or a URL with one."""
    left = [data]
    while left:
        value = left.pop()
        if isinstance(value, list):
            left += value
        elif isinstance(value, dict):
            if any(_is_secret(key, each) for key, each in value.items()):
                return True
            left += value.values()
        elif isinstance(value, str) and "://" in value and _in_address(value):
            return True
    return False


def _in_address(text: str) -> bool:
    try:
        parts = urlsplit(text)
        pairs = parse_qsl(parts.query)
    except ValueError:
        return False
    return "@" in parts.netloc or any(_is_secret(*pair) for pair in pairs)


def _is_secret(key: str, value: Any) -> bool:
    return isinstance(value, str) and value != "" and bool(_SECRET.search(key))
