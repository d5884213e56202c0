"""Processes that run Python: their start and end, ports, memory and loading."""

import asyncio
import contextlib
import errno
import importlib
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import IO

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


@dataclass(frozen=True)
class ChildProcess:
    """A process whose first line reports that it is ready."""

    process: "subprocess.Popen[str]"
    stdin: IO[str]
    """Its standard input; the process ends when this is closed."""

    @cached_property
    def line(self) -> str:
        """The first line, for which this waits; empty if the process ended before."""
        assert self.process.stdout is not None
        return self.process.stdout.readline()


@contextmanager
def child_process(module: str, *arguments: object) -> Iterator[ChildProcess]:
    """Run a module as a child process of a command until the block ends."""
    with subprocess.Popen(
        python_command(module, *arguments),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stdin is not None
        try:
            yield ChildProcess(process, process.stdin)
        finally:
            process.terminate()
            try:
                process.wait(GRACE)
            except subprocess.TimeoutExpired:
                process.kill()


def why_not_listening(host: str, port: int, error: OSError) -> str:
    """Return one sentence, with advice, for a port that cannot be listened on."""
    if error.errno == errno.EADDRINUSE:
        return (
            f"port {port} on {host} is in use: end the program that uses it, or choose "
            "another port; 0 lets the system choose"
        )
    if error.errno == errno.EACCES:
        return f"port {port} on {host} is not permitted: use one from 1024 to 65535"
    if error.errno == errno.EADDRNOTAVAIL:
        return f"{host} is not an address of this machine"
    return f"cannot listen on {host}, port {port}: {error.strerror}"


LARGE = 4 * 2**20
"""Bytes from which a block of memory is returned to the system when it is freed."""

_M_MMAP_THRESHOLD = -3


def return_large_pieces() -> None:
    """Return every large block of memory to the system as soon as it is freed.

    By default glibc raises the limit for this to the size of the largest block that was
    freed, up to 32 MiB. Smaller blocks come from a heap that shrinks only at its end:
    one small block behind a freed map keeps the memory of the map. Setting the limit
    ends the raising (see ``mallopt(3)``). Other C libraries are not changed.
    """
    import ctypes
    import platform

    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, LARGE)


async def load(module: str) -> None:
    """Import a module in a thread, and wait for it.

    The first import of numpy takes 0.1 s of processor time, that of a WebSocket client
    30 ms. The event loop goes on meanwhile.
    """
    if module not in sys.modules:
        await asyncio.to_thread(importlib.import_module, module)


def load_soon(module: str) -> None:
    """Begin to import a module in a thread; does nothing without an event loop.

    Code that needs the module imports it all the same, which waits for the thread.
    """
    if module in sys.modules:
        return
    try:
        loop = asyncio.get_running_loop()
    except RuntimeError:
        return
    loop.run_in_executor(None, importlib.import_module, module)
