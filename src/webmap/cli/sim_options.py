"""Options of the simulator that ``webmap demo`` has too."""

from collections.abc import Callable
from typing import Any, TypeVar

import click

F = TypeVar("F", bound=Callable[..., Any])


def simulator_options(*, robots: str, dialect: str) -> Callable[[F], F]:
    """Return what adds how many robots there are, where they start, and which ROS.

    Args:
        robots: What is said of ``--robots``, which is None if it was not said.
        dialect: What is said of ``--dialect``.

    """

    def add(command: F) -> F:
        for option in (
            click.option(
                "--dialect",
                type=click.Choice(["ros1", "ros2"]),
                default="ros1",
                show_default=True,
                help=dialect,
            ),
            click.option(
                "--seed",
                type=int,
                default=1,
                show_default=True,
                help="Where they start.",
            ),
            click.option("--robots", "-n", type=click.IntRange(1, 500), help=robots),
        ):
            command = option(command)
        return command

    return add
