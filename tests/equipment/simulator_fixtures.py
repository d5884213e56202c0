"""Simulators for tests of commands, and a port for a server that starts later."""

import socket
from collections.abc import Iterator

import pytest

from equipment.webmap_process import simulator


@pytest.fixture
def later_port() -> Iterator[int]:
    """A port on which nothing listens yet, reserved for this test."""
    with socket.socket() as kept:
        # With this option another socket may listen on the port.
        kept.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        kept.bind(("127.0.0.1", 0))
        yield kept.getsockname()[1]


@pytest.fixture(scope="session")
def ros1() -> Iterator[str]:
    """The address of a simulated rosbridge of ROS 1, with two robots."""
    with simulator("--port", "0") as url:
        yield url


@pytest.fixture(scope="session")
def ros2() -> Iterator[str]:
    """The address of a simulated rosbridge of ROS 2 with a robot for TwistStamped."""
    with simulator(
        "--port",
        "0",
        "--dialect",
        "ros2",
        "--flat",
        "--twist",
        "TwistStamped",
        "--robot-timeout",
        "0",
    ) as url:
        yield url
