"""Simulators that the commands may use."""

from collections.abc import Iterator

import pytest

from webmap_process import simulator


@pytest.fixture(scope="session")
def ros1() -> Iterator[str]:
    """The address of a simulated rosbridge of ROS 1, with two robots."""
    with simulator("--port", "0") as url:
        yield url


@pytest.fixture(scope="session")
def ros2() -> Iterator[str]:
    """The address of one of ROS 2, with a bare robot that takes TwistStamped."""
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
