"""Paired runs: A B A B, with medians and ratios, as a Markdown table and as JSON.

A single figure depends more on the machine than on the code. Therefore the contenders
of a comparison run one after the other, in several rounds, and only the ratio within a
round counts: a slow machine slows both.
"""

import json
import math
import os
import platform
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

Figures = dict[str, float]
"""Figures of one run by name; the name ends in its unit, such as ``"cpu (us)"``."""

RESULTS = Path(__file__).parent / "results"

LOAD_BEFORE = os.getloadavg()[0]
"""Processes that ran on this machine before the first benchmark."""

PACKAGES = (
    "webmap",
    "websockets",
    "msgspec",
    "numpy",
    "cbor2",
    "uvicorn",
    "uvloop",
    "eclipse-zenoh",
    "roslibpy",
    "nicegui",
    "viser",
    "playwright",
)
"""The packages whose versions are in the results."""


@dataclass(frozen=True, slots=True)
class Contender:
    """One method to do the work."""

    name: str
    """Its name in the table."""

    run: Callable[[], Figures]
    """Do the work once, in a separate process if necessary."""


@dataclass(slots=True)
class Comparison:
    """The figures of the contenders; the first one is the reference of the others."""

    title: str
    runs: dict[str, list[Figures]] = field(default_factory=dict)

    def median(self, name: str, figure: str) -> float:
        """Return the median of one figure over the rounds."""
        return statistics.median(run[figure] for run in self.runs[name])

    def ratios(self, name: str, figure: str) -> list[float]:
        """Return this contender's figure divided by the first one's, round by round."""
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
        return f"{text} ({_short(middle)} x, {_short(low)} to {_short(high)})"

    def as_dict(self) -> dict[str, object]:
        """Return all figures, with medians and ratios."""
        figures = list(next(iter(self.runs.values()))[0])
        return {
            "title": self.title,
            "runs": self.runs,
            "medians": {n: {f: self.median(n, f) for f in figures} for n in self.runs},
            "ratios": {n: {f: self.ratios(n, f) for f in figures} for n in self.runs},
        }


def _short(ratio: float) -> str:
    return f"{ratio:.2f}" if ratio >= 0.1 else f"{ratio:.1g}"


MOST_SECONDS = math.inf
"""Seconds that a comparison may take, beyond its first round."""


def compare(title: str, contenders: Sequence[Contender], rounds: int) -> Comparison:
    """Run the contenders in turn, ``rounds`` times.

    Every other round has the opposite order, so that no contender always runs second.
    No round begins that would end after :data:`MOST_SECONDS`, except for the first.

    Raises:
        ValueError: If ``rounds`` is less than 1, or there is no contender.

    """
    if rounds < 1 or not contenders:
        raise ValueError(f"expected contenders and rounds, got {rounds} rounds")
    comparison = Comparison(title, {contender.name: [] for contender in contenders})
    begun = time.monotonic()
    for number in range(rounds):
        took = time.monotonic() - begun
        if number and took + took / number > MOST_SECONDS:
            break
        for contender in contenders if number % 2 == 0 else reversed(contenders):
            print(f"{title}: round {number + 1}, {contender.name}", file=sys.stderr)
            comparison.runs[contender.name].append(contender.run())
    return comparison


def percentile(values: Sequence[float], percent: int) -> float:
    """Return a percentile; NaN if there are no values."""
    if not values:
        return math.nan
    return sorted(values)[min(len(values) - 1, len(values) * percent // 100)]


def machine() -> dict[str, object]:
    """Return the properties of the machine that affect the figures."""
    return {
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.release()}",
        "processor": platform.machine(),
        "cores": os.cpu_count(),
        "load before": LOAD_BEFORE,
        "versions": {name: _version(name) for name in PACKAGES},
    }


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def report(
    name: str,
    comparisons: Sequence[Comparison],
    seconds: float = 0.0,
    *,
    rough: bool = False,
) -> Path:
    """Print the tables, and write everything as JSON.

    Args:
        name: The name of the benchmark.
        comparisons: The results.
        seconds: The duration of the benchmark.
        rough: Whether it did only a part of the work; such results are in a separate
            folder.

    Returns:
        The file that was written.

    """
    for comparison in comparisons:
        print(comparison.table(), end="\n\n", flush=True)
    folder = RESULTS / "rough" if rough else RESULTS
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.json"
    content = {
        "machine": machine(),
        "seconds": round(seconds, 1),
        "rough": rough,
        "comparisons": [comparison.as_dict() for comparison in comparisons],
    }
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return path
