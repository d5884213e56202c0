"""The costs of a changed square of a map; they do not depend on the map's size.

The map has 1,000 x 1,000 or 4,000 x 4,000 cells, and the square 100 x 100. The last
contender publishes the whole large map again, with one changed cell.
"""

import json
import subprocess
import sys
from collections.abc import Callable

from benchmarks.harness import Comparison, Contender, Figures, compare


def reading(side: int, order: str, count: int) -> Callable[[], Figures]:
    """Return a run with ``count`` changes of a map with ``side`` cells on each side."""

    def run() -> Figures:
        command = [sys.executable, "-m", "benchmarks.map_reader", str(side), order]
        finished = subprocess.run(
            [*command, str(count)], stdout=subprocess.PIPE, text=True, check=True
        )
        figures: Figures = json.loads(finished.stdout)
        return figures

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare changes of a small map with those of a large one."""
    count = 3 if quick else 20
    contenders = [
        Contender("a square of 1,000 x 1,000", reading(1000, "update", count)),
        Contender("a square of 4,000 x 4,000", reading(4000, "update", count)),
        Contender("all of 4,000 x 4,000", reading(4000, "map", count)),
    ]
    return [compare("A changed map", contenders, rounds)]
