"""A process that runs beside a command, and ends with it however that ends."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, NamedTuple

from webmap.base.children import GRACE, python_command


class Beside(NamedTuple):
    """What there is of a process that has said its first line."""

    process: "subprocess.Popen[str]"
    told: IO[str]
    """Its standard input, whose end is its own."""
    line: str
    """What it said first; empty if it ended without a word."""


@contextmanager
def beside(module: str, *arguments: object) -> Iterator[Beside]:
    """Run a module as a process beside this one, until the block ends."""
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
            yield Beside(process, process.stdin, process.stdout.readline())
        finally:
            process.terminate()
            try:
                process.wait(GRACE)
            except subprocess.TimeoutExpired:
                process.kill()
