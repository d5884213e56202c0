"""Start and end of child processes that run Python."""

import contextlib
import os
import sys
import threading
import time
from collections.abc import Callable

GRACE = 3.0
"""Seconds in which a process can end in order after the end of its parent."""


def python_command(module: str, *arguments: object) -> list[str]:
    """Return the command line that runs a module in another Python.

    ``-P`` keeps the working folder out of the module search path. Without it, a file
    such as ``msgspec.py`` in that folder would run instead of the real module. The
    variable ``PYTHONPATH`` stays in effect.

    Args:
        module: The module, such as ``webmap.gate``.
        arguments: The arguments after the module.

    """
    return [sys.executable, "-P", "-m", module, *map(str, arguments)]


def end_with_parent(
    end: Callable[[], object],
    on_data: Callable[[bytes], object] = lambda _: None,
    grace: float = GRACE,
) -> None:
    """End this process when its standard input ends.

    The parent holds the other end of that pipe, so the pipe ends with the parent, also
    when the parent is killed. A process that still runs after ``grace`` seconds,
    because it hangs, exits at once.

    Args:
        end: Called once when the input ends, in a thread of its own.
        on_data: Called with all data that arrives, in the same thread.
        grace: Seconds between ``end`` and the exit.

    """

    def watch() -> None:
        # Do not use sys.stdin: its lock would be held while the interpreter ends.
        with contextlib.suppress(OSError, RuntimeError):
            while data := os.read(0, 4096):
                on_data(data)
        with contextlib.suppress(RuntimeError):  # the event loop is already closed
            end()
        time.sleep(grace)
        os._exit(1)

    threading.Thread(target=watch, name="parent", daemon=True).start()
