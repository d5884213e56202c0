"""``webmap log``: the shift log, in a terminal or as CSV."""

import re
import time

import click

from webmap.base.echo import echo
from webmap.base.errors import ConfigError
from webmap.gate.locks import state_folder

_SECONDS = {"m": 60.0, "h": 3600.0, "d": 86_400.0}


def _seconds(text: str) -> float:
    found = re.fullmatch(r"(\d{1,6})([mhd])", text)
    if found is None:
        raise ConfigError(
            f"--since: expected a time such as 30m, 12h or 7d, got {text!r}"
        )
    return int(found[1]) * _SECONDS[found[2]]


@click.command()
@click.option("--since", default="12h", show_default=True, help="How far back: 7d.")
@click.option("--kind", default="all", help="Only this kind, such as stop or note.")
@click.option("--robot", default="", help="Only the robot of this name.")
@click.option("--csv", "as_csv", is_flag=True, help="Print CSV.")
def log(since: str, kind: str, robot: str, as_csv: bool) -> None:
    """Print the shift log of this machine's user, the newest entry last."""
    from webmap.core.shift_choice import Choice, csv_of
    from webmap.core.shift_files import FOLDER, read_newest

    begins, choice = time.time() - _seconds(since), Choice(kind=kind)
    found = read_newest(state_folder() / FOLDER, 1_000_000, begins)
    chosen = [
        entry
        for entry in found
        if entry.unix >= begins
        and choice.has(entry, "admin")
        and robot in ("", entry.robot_name, entry.robot)
    ]
    if as_csv:
        click.echo(csv_of(chosen), nl=False)
        return
    for entry in chosen:
        when = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(entry.unix))
        who = f"{entry.person}{'*' if entry.verified is False else ''}"
        about = " ".join(each for each in (entry.robot_name, who) if each)
        echo(f"{when}  {entry.kind:<8} {about}: {entry.text}")
    if not chosen:
        echo(f"There are no such entries in {state_folder() / FOLDER}")
