"""A child process of a command, which ends when the command ends."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import IO

from webmap.base.children import GRACE, python_command


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
    """Run a module in another Python until the block ends."""
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
