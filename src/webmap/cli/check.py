"""``webmap check FILE``: validates a fleet file."""

from pathlib import Path

import click

from webmap.base.counted import counted
from webmap.base.echo import echo
from webmap.cli.options import verbose_option


@click.command(short_help="Validate a fleet file and list its mistakes.")
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@verbose_option
def check(file: Path) -> None:
    """Validate a fleet file as webmap run reads it, and list its mistakes.

    No connection is opened. Every mistake is shown with its line; the exit code is 2
    if there is one.
    """
    from webmap.fleet.fleet_file import prepare

    ready = prepare(file)
    robots = counted(len(ready.robots), "robot")
    if ready.agents:
        robots += " and the robots of agents"
    bridges = counted(len(ready.fleet.bridges), "bridge")
    echo(f"{file}: {robots} behind {bridges}, no mistakes")
