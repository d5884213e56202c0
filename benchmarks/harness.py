"""Paired runs: A B A B, medians, ratios, a table for people and JSON for the rest.

A figure by itself says more about the machine than about the code. So the contenders
of a comparison run in turn, round after round, and what counts is the ratio within a
round: whatever slowed the machine down slowed both.
"""

import json
import os
import platform
import statistics
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

Figures = dict[str, float]
"""What one run measured, by name; the name ends in its unit, such as ``"cpu (us)"``."""

RESULTS = Path(__file__).parent / "results"


@dataclass(frozen=True, slots=True)
class Contender:
    """One way to do the work."""

    name: str
    """What the table calls it."""

    run: Callable[[], Figures]
    """Do the work once, in a process of its own where that matters."""


@dataclass(slots=True)
class Comparison:
    """What the contenders measured; the first one is what the others are held to."""

    title: str
    runs: dict[str, list[Figures]] = field(default_factory=dict)

    def median(self, name: str, figure: str) -> float:
        """Return the median of one figure over the rounds."""
        return statistics.median(run[figure] for run in self.runs[name])

    def ratios(self, name: str, figure: str) -> list[float]:
        """Return this contender's figure by the first one's, round by round."""
        first = next(iter(self.runs.values()))
        pairs = zip(self.runs[name], first, strict=True)
        return [run[figure] / base[figure] for run, base in pairs if base[figure]]

    def table(self) -> str:
        """Return the medians and the ratios with their range, as Markdown."""
        names = list(self.runs)
        figures = list(self.runs[names[0]][0])
        lines = [f"### {self.title}", "", "| figure | " + " | ".join(names) + " |"]
        lines.append("|---" * (len(names) + 1) + "|")
        for figure in figures:
            cells = [self._cell(name, figure) for name in names]
            lines.append(f"| {figure} | " + " | ".join(cells) + " |")
        return "\n".join(lines)

    def _cell(self, name: str, figure: str) -> str:
        text = f"{self.median(name, figure):.3g}"
        ratios = self.ratios(name, figure)
        if name == next(iter(self.runs)) or not ratios:
            return text
        middle, low, high = statistics.median(ratios), min(ratios), max(ratios)
        return f"{text} ({middle:.2f} x, {low:.2f} to {high:.2f})"

    def as_dict(self) -> dict[str, object]:
        """Return everything that was measured, and the medians and ratios."""
        figures = list(next(iter(self.runs.values()))[0])
        return {
            "title": self.title,
            "runs": self.runs,
            "medians": {n: {f: self.median(n, f) for f in figures} for n in self.runs},
            "ratios": {n: {f: self.ratios(n, f) for f in figures} for n in self.runs},
        }


def compare(title: str, contenders: Sequence[Contender], rounds: int) -> Comparison:
    """Let the contenders run in turn, ``rounds`` times.

    Every other round goes the other way round, so that none always follows the same.

    Raises:
        ValueError: If ``rounds`` is less than 1, or there is no contender.

    """
    if rounds < 1 or not contenders:
        raise ValueError(f"expected contenders and rounds, got {rounds} rounds")
    comparison = Comparison(title, {contender.name: [] for contender in contenders})
    for number in range(rounds):
        for contender in contenders if number % 2 == 0 else reversed(contenders):
            print(f"{title}: round {number + 1}, {contender.name}", file=sys.stderr)
            comparison.runs[contender.name].append(contender.run())
    return comparison


def machine() -> dict[str, object]:
    """Return what the figures depend on besides the code."""
    return {
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.release()}",
        "processor": platform.machine(),
        "cores": os.cpu_count(),
        "load before": os.getloadavg()[0],
    }


def report(name: str, comparisons: Sequence[Comparison]) -> Path:
    """Print the tables, and write everything as JSON.

    Returns:
        The file that was written.

    """
    for comparison in comparisons:
        print(comparison.table(), end="\n\n", flush=True)
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}.json"
    content = {
        "machine": machine(),
        "comparisons": [comparison.as_dict() for comparison in comparisons],
    }
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return path
