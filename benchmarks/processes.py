"""Processes that run beside a benchmark, and their processor time."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import psutil


@contextmanager
def module(name: str, *arguments: object) -> Iterator[tuple[str, psutil.Process]]:
    """Run a module of Python; yield its first line, and its process."""
    command = [sys.executable, "-m", name, *map(str, arguments)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        try:
            assert running.stdout is not None
            yield running.stdout.readline().strip(), psutil.Process(running.pid)
        finally:
            running.terminate()


@contextmanager
def started(*command: object, state: str = "") -> Iterator[tuple[str, psutil.Process]]:
    """Run a command of WebMap; yield the address in its first line, and its process.

    Args:
        command: The arguments after ``webmap`` on the command line.
        state: The folder of its state; "" for the folder of this process.

    Raises:
        RuntimeError: If its first line has no address.

    """
    with subprocess.Popen(
        [sys.executable, "-m", "webmap", *map(str, command)],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | ({"WEBMAP_STATE_DIR": state} if state else {}),
    ) as running:
        try:
            assert running.stdout is not None
            line = running.stdout.readline()
            if " at " not in line:
                raise RuntimeError(f"expected an address, got {line!r}")
            yield line.rpartition(" at ")[2].strip(), psutil.Process(running.pid)
        finally:
            running.terminate()


def used(process: psutil.Process) -> float:
    """Return the seconds of processor time of a process and its children."""
    every = [process, *process.children(recursive=True)]
    return sum(sum(each.cpu_times()[:2]) for each in every)
