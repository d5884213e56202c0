"""A child process of a command, which ends when the command ends."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, NamedTuple

from webmap.base.children import GRACE, python_command


class ChildProcess(NamedTuple):
    """A process that has written its first line."""

    process: "subprocess.Popen[str]"
    stdin: IO[str]
    """Its standard input; the process ends when this is closed."""
    line: str
    """The first line that it wrote; empty if it ended before."""


@contextmanager
def child_process(module: str, *arguments: object) -> Iterator[ChildProcess]:
    """Run a module in another Python until the block ends."""
    with subprocess.Popen(
        python_command(module, *arguments),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdin is not None
        try:
            yield ChildProcess(process, process.stdin, process.stdout.readline())
        finally:
            process.terminate()
            try:
                process.wait(GRACE)
            except subprocess.TimeoutExpired:
                process.kill()
