"""Simulators that the commands may use."""

import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest


@contextmanager
def simulator(*options: str) -> Iterator[str]:
    command = [sys.executable, "-m", "webmap", "sim", "--port", "0", *options]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        try:
            found = re.search(r"ready at (ws://\S+)", process.stdout.readline())
            assert found
            yield found[1]
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(10)


@pytest.fixture(scope="session")
def ros1() -> Iterator[str]:
    """The address of a simulated rosbridge of ROS 1, with two robots."""
    with simulator() as url:
        yield url


@pytest.fixture(scope="session")
def ros2() -> Iterator[str]:
    """The address of one of ROS 2, with a bare robot that takes TwistStamped."""
    with simulator(
        "--dialect", "ros2", "--flat", "--twist", "TwistStamped", "--robot-timeout", "0"
    ) as url:
        yield url
