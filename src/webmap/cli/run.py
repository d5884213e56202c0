"""``webmap run FILE`` serves a script or a fleet file; ``webmap check`` checks one."""

import runpy
import sys
from pathlib import Path
from typing import Any

import click

from webmap.base.echo import echo
from webmap.base.plain_files import refuse_special
from webmap.base.text import counted
from webmap.cli.options import incidents_option, verbose_option, web_options


@click.command(short_help="Serve your own pages, or the robots of a fleet file.")
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@incidents_option
@web_options
def run(file: Path, no_incidents: bool, web: dict[str, Any]) -> None:
    """Serve the pages that FILE.py makes, or the fleet that FILE.toml describes.

    A script makes pages with @webmap.page and may call webmap.run() itself; the
    options of this command override the arguments of that call. A fleet file lists
    bridges, robots and modules; webmap check FILE.toml shows its mistakes.
    """
    from webmap.server import application

    if file.suffix.lower() == ".toml":
        from webmap.fleet.fleet_file import open_fleet, prepare

        open_fleet(prepare(file), incidents=not no_incidents)
        application.run(**web)
        return
    refuse_special(file)
    application.command_line.update(**web)
    sys.path.insert(0, str(file.resolve().parent))
    sys.argv = [str(file)]
    runpy.run_path(str(file), run_name="__main__")
    if not application.has_run:
        application.run()


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
