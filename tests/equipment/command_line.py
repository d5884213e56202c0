"""Run the command line in this process, for commands that end by themselves.

A separate process takes half a second to start. Another test of each command uses one.
"""

import io
import logging
import os
import signal
import sys
from contextlib import ExitStack, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from unittest.mock import patch

from webmap.cli import main
from webmap.core.motion import RobotMotion

SIGNALS = (signal.SIGINT, signal.SIGTERM)
LOGGERS = ("websockets", "uvicorn", "asyncio", "PIL")


@dataclass(frozen=True)
class Done:
    """The result of a command, like the result of ``subprocess.run``."""

    returncode: int
    stdout: str
    stderr: str


def run_inside(*arguments: object, stdin: str = "") -> Done:
    """Run a command.

    Args:
        *arguments: The arguments after ``webmap``.
        stdin: The text of standard input.

    """
    out, err = io.StringIO(), io.StringIO()
    with ExitStack() as after:
        for number in SIGNALS:
            after.callback(signal.signal, number, signal.getsignal(number))
        for name in LOGGERS:
            logger = logging.getLogger(name)
            after.callback(logger.setLevel, logger.level)
        after.enter_context(patch.dict(os.environ))
        # `webmap agent` sets the agent of its process.
        after.enter_context(patch.object(RobotMotion, "agent", ""))
        command = ["webmap", *map(str, arguments)]
        after.enter_context(patch.object(sys, "argv", command))
        stdin = io.TextIOWrapper(io.BytesIO(stdin.encode()), "utf-8")
        after.enter_context(patch.object(sys, "stdin", stdin))
        after.enter_context(redirect_stdout(out))
        after.enter_context(redirect_stderr(err))
        try:
            main()
        except SystemExit as end:
            code = end.code
        else:
            code = 0
    assert isinstance(code, int)
    return Done(code, out.getvalue(), err.getvalue())
