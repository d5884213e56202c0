"""The figures of a run, and the table of them that the documentation shows.

The tests write what they measure as lines of JSON into the file that the environment
names by WEBMAP_SAFETY_FIGURES. ``python tests/safety/safety_figures.py FILE`` makes
``docs/safety-figures.md`` and ``docs/safety-figures.json`` of them.
"""

import json
import os
import platform
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


@dataclass(frozen=True)
class Figure:
    """What was measured of one fault; times in seconds."""

    name: str
    stops_by: str
    promised: float
    worst: float
    jitter: float
    trials: int


def note(figure: Figure) -> None:
    """Keep a figure, if this run is one that keeps them."""
    print(figure)
    if path := os.environ.get("WEBMAP_SAFETY_FIGURES"):
        with Path(path).open("a") as file:
            file.write(json.dumps(asdict(figure)) + "\n")


def table(figures: list[Figure]) -> str:
    """Return the figures as a table in Markdown."""
    lines = [
        "---",
        "orphan: true",
        "---",
        "",
        "| what fails while W is held | stopped by | promised | worst measured "
        "| machine late by | trials |",
        "|---|---|---|---|---|---|",
    ]
    by = {"zero": "a zero", "itself": "its own timeout", "key": "a zero"}
    lines += [
        f"| {f.name} | {by[f.stops_by]} | {f.promised * 1000:.0f} ms "
        f"| {f.worst * 1000:.0f} ms | {f.jitter * 1000:.0f} ms | {f.trials} |"
        for f in figures
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the table and the figures where the documentation includes them."""
    lines = Path(sys.argv[1]).read_text().splitlines()
    newest = {figure["name"]: Figure(**figure) for figure in map(json.loads, lines)}
    figures = list(newest.values())
    (DOCS / "safety-figures.md").write_text(table(figures))
    content = {
        "machine": {
            "processors": os.cpu_count(),
            "python": platform.python_version(),
            "system": platform.system(),
        },
        "figures": [asdict(figure) for figure in figures],
    }
    (DOCS / "safety-figures.json").write_text(json.dumps(content, indent=2) + "\n")


if __name__ == "__main__":
    main()
