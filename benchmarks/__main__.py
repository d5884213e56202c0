"""Run the benchmarks: ``python -m benchmarks [NAME ...] [--rounds N] [--quick]``."""

import importlib
import math
import sys
import time
import traceback
from dataclasses import dataclass

import click

from benchmarks import harness
from benchmarks.harness import Comparison, report


@dataclass(frozen=True, slots=True)
class Row:
    """One benchmark, in the module of its name."""

    name: str
    seconds: float
    """The time of each comparison; all benchmarks take less than 15 minutes."""

    quick: bool = False
    """Whether ``--quick`` runs it; these benchmarks take 2 minutes together."""


ROWS = [
    Row("bridge", 20, quick=True),
    Row("links", 4, quick=True),
    Row("viewers", 12, quick=True),
    Row("wire", 20, quick=True),
    Row("grids", 25),
    Row("drawing", 25, quick=True),
    Row("latency", 25),
    Row("video", 40),
    Row("peers", 25),
    Row("limits", 45),
    Row("console", 60),
    Row("opening", 12),
    Row("agents", 20),
    Row("uplink", 40),
    Row("narrow", 40),
    Row("transports", 10),
    Row("router", 15),
    Row("idle", 20, quick=True),
    Row("unwatched", 40),
]

BENCHES = {row.name: row for row in ROWS}

MOST_ROUNDS = 9
"""The greatest number of rounds of a comparison, even if time is left."""


@click.command()
@click.argument("names", nargs=-1, type=click.Choice(list(BENCHES)))
@click.option("--rounds", type=click.IntRange(1), help="Runs of each contender.")
@click.option("--quick", is_flag=True, help="A tenth of the work: rough results.")
def main(names: tuple[str, ...], rounds: int | None, quick: bool) -> None:
    """Run the benchmarks called NAMES, or all of them; with --quick, the cheap ones."""
    rows = [BENCHES[name] for name in names] or [
        row for row in ROWS if row.quick or not quick
    ]
    took: dict[str, float] = {}
    failed = []
    for row in rows:
        begun = time.monotonic()
        try:
            comparisons = run(row, rounds, quick=quick)
        except Exception:  # the other benchmarks do not depend on it
            traceback.print_exc()
            failed.append(row.name)
        took[row.name] = time.monotonic() - begun
        if row.name not in failed:
            path = report(row.name, comparisons, took[row.name], rough=quick)
            click.echo(f"written to {path}\n", err=True)
    click.echo("| benchmark | seconds |\n|---|---|")
    for name, seconds in took.items():
        click.echo(f"| {name} | {seconds:.0f}{' (failed)' * (name in failed)} |")
    click.echo(f"| all | {sum(took.values()):.0f} |")
    sys.exit(1 if failed else 0)


def run(row: Row, rounds: int | None, *, quick: bool) -> list[Comparison]:
    """Run one benchmark, with as many rounds as its time allows if none are given."""
    harness.MOST_SECONDS = row.seconds if rounds is None else math.inf
    rounds = 1 if quick else rounds or MOST_ROUNDS
    bench = importlib.import_module(f"benchmarks.{row.name}").bench
    comparisons: list[Comparison] = bench(rounds=rounds, quick=quick)
    if quick:
        for comparison in comparisons:
            comparison.title += " (rough: a tenth of the work, once)"
    return comparisons


if __name__ == "__main__":
    main()
