"""Options that several commands have."""

import logging
import math
from collections.abc import Callable
from typing import Any, TypeVar

import click

from webmap.logs import set_up_logging

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
