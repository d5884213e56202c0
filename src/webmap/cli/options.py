"""Options that several commands have."""

import logging
import math
from collections.abc import Callable
from typing import Any, TypeVar

import click

from webmap.base.logs import set_up_logging

F = TypeVar("F", bound=Callable[..., Any])

PORT = click.IntRange(0, 65535)


class Finite(click.FloatRange):
    """Numbers of a range, and neither infinity nor what is no number."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        """Return the number that a text says."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


wait_option = click.option(
    "--wait",
    type=Finite(0.0),
    default=5.0,
    show_default=True,
    help="Seconds to wait for a rosbridge that cannot be reached.",
)
"""How long a command waits for a rosbridge."""


def web_options(command: F) -> F:
    """Add where the web interface listens, and what opens it."""
    for option in (
        click.option(
            "--insecure-lan",
            is_flag=True,
            help="Allow a --host that other machines reach, without TLS.",
        ),
        click.option(
            "--host",
            default="127.0.0.1",
            show_default=True,
            help="Address that the web interface listens on.",
        ),
        click.option(
            "--port",
            "-p",
            type=PORT,
            default=8080,
            show_default=True,
            help="Port of the web interface; 0 lets the system choose.",
        ),
        click.option(
            "--no-browser", is_flag=True, help="Do not open the page in a browser."
        ),
        verbose_option,
    ):
        command = option(command)
    return command


def _set_up_log(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    set_up_logging(logging.DEBUG if value else logging.INFO)


verbose_option = click.option(
    "--verbose",
    "-v",
    is_flag=True,
    expose_value=False,
    callback=_set_up_log,
    help="Log more, to standard error.",
)


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
