"""The simulator of ``webmap demo``, as a child process."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import NoReturn

from webmap.base.errors import ConfigError
from webmap.base.processes import GRACE, child_process

READY = "rosbridge is ready at "
USAGE = 2
"""Exit status of a command that has reported an error in one sentence."""


def _give_up(status: int) -> NoReturn:
    """End the command, with an error if the simulator has reported none."""
    if status == USAGE:
        sys.exit(USAGE)
    raise ConfigError(f"the simulator ended with status {status} before it was ready")


@contextmanager
def simulator(*arguments: object) -> Iterator[str]:
    """Run ``webmap sim`` as a child process and yield the URL of its rosbridge.

    It ends with this process, however that ends, because its standard input closes.

    Raises:
        ConfigError: If it does not start.

    """
    with child_process("webmap", "sim", "--with-parent", *arguments) as started:
        # The simulator starts meanwhile, which takes half a second as well.
        import_module("webmap.console")
        if not started.line.startswith(READY):
            _give_up(started.process.wait(GRACE))
        yield started.line.removeprefix(READY).strip()
