"""Run the benchmarks: ``python -m benchmarks [NAME ...] [--rounds N] [--quick]``."""

import importlib

import click

from benchmarks.harness import report

BENCHES = [
    "bridge",
    "viewers",
    "wire",
    "grids",
    "drawing",
    "console",
    "opening",
    "agents",
    "uplink",
    "narrow",
    "transports",
    "router",
    "idle",
]


@click.command()
@click.argument("names", nargs=-1, type=click.Choice(BENCHES))
@click.option("--rounds", default=5, show_default=True, help="Runs of each contender.")
@click.option("--quick", is_flag=True, help="A tenth of the work: a look, no figures.")
def main(names: tuple[str, ...], rounds: int, quick: bool) -> None:
    """Run the benchmarks called NAMES, or all of them."""
    for name in names or BENCHES:
        bench = importlib.import_module(f"benchmarks.{name}").bench
        path = report(name, bench(rounds=rounds, quick=quick))
        click.echo(f"written to {path}\n", err=True)


if __name__ == "__main__":
    main()
