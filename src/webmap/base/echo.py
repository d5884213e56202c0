"""Output of commands: names and texts of robots must not control the terminal."""

import contextlib

import click

from webmap.base.logs import budgets
from webmap.base.text import lines_of, one_line

LONGEST = 10_000
"""Most characters of a printed line; a list of topics may be long."""


def echo(text: object, *, err: bool = False, lines: bool = False) -> None:
    """Print text and a line break; characters that are not printable are escaped.

    Args:
        text: The text.
        err: Whether to print to standard error.
        lines: Whether line breaks in the text are WebMap's own, and are kept.

    """
    click.echo((lines_of if lines else one_line)(text, LONGEST), err=err)


def notify(text: str) -> None:
    """Print a line on standard error, within the limit of a log.

    Robots that appear cause such lines. A full disk and a closed pipe are ignored.
    """
    added = budgets.note(("say",), "")
    if added is None:
        return
    with contextlib.suppress(OSError, ValueError):
        echo(f"{text}{added}", err=True)
