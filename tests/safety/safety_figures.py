"""The figures of a run, and the table of them that the documentation shows.

The tests write what they measure as lines of JSON into the file that the environment
names by WEBMAP_SAFETY_FIGURES, each as soon as its scenario has ended, so that a run
may be cut and resumed. ``python tests/safety/safety_figures.py FILE`` makes
``docs/safety-figures.md`` and ``docs/safety-figures.json`` of them.
"""

import json
import os
import platform
import subprocess
import sys
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from safety_run import TRIALS, version

DOCS = Path(__file__).parents[2] / "docs"
FIRST_PAGE = Path(__file__).with_name("safety_first_page.py")
"""Writes the worst of them into the README."""


@dataclass(frozen=True)
class Figure:
    """What was measured of one fault; times in seconds."""

    name: str
    stops_by: str
    promised: float
    worst: float
    jitter: float
    trials: int
    version: str = field(default_factory=version)
    asked: int = TRIALS
    """How many trials the whole run was asked for."""


@dataclass(frozen=True)
class Soak:
    """What half an hour of everything at once has shown; see the unit."""

    soak: str
    unit: str
    promised: float | None
    measured: float
    version: str = field(default_factory=version)


def note(figure: Figure | Soak) -> None:
    """Keep a figure, if this run is one that keeps them."""
    print(figure)
    if path := os.environ.get("WEBMAP_SAFETY_FIGURES"):
        with Path(path).open("a") as file:
            file.write(json.dumps(asdict(figure)) + "\n")


def machine() -> dict[str, Any]:
    """Return what the figures depend on, and nothing that tells whose it is."""
    return {
        "processors": os.cpu_count(),
        "python": platform.python_version(),
        "kernel": f"{platform.system()} {platform.release()}",
    }


def table(figures: list[Figure], soaks: list[Soak], measured_on: dict[str, Any]) -> str:
    """Return the figures as tables in Markdown, and a line on the machine."""
    lines = [
        "---",
        "orphan: true",
        "---",
        "",
        "| what fails while W is held | stopped by | promised | worst measured "
        "| machine late by | trials | version |",
        "|---|---|---|---|---|---|---|",
    ]
    by = {"zero": "a zero", "itself": "its own timeout", "key": "a zero"}
    lines += [
        f"| {f.name} | {by[f.stops_by]} | {f.promised * 1000:.0f} ms "
        f"| {f.worst * 1000:.0f} ms | {f.jitter * 1000:.0f} ms | {f.trials} "
        f"| {f.version} |"
        for f in figures
    ]
    if soaks:
        lines += [
            "",
            "| half an hour of everything at once | promised | measured | version |",
            "|---|---|---|---|",
        ]
    for soak in soaks:
        promised = "" if soak.promised is None else f"{soak.promised:.0f} {soak.unit}"
        lines.append(
            f"| {soak.soak} | {promised} | {soak.measured:.1f} {soak.unit} "
            f"| {soak.version} |"
        )
    lines += [
        "",
        f"Measured on {measured_on['processors']} processors, "
        f"{measured_on['kernel']}, Python {measured_on['python']}.",
    ]
    return "\n".join(lines) + "\n"


def newest(type: Any, key: str, noted: list[dict[str, Any]]) -> list[Any]:
    """Return the last figure of each name, of one of the types."""
    return list({f[key]: type(**f) for f in noted if key in f}.values())


def main() -> None:
    """Write the table and the figures where the documentation includes them."""
    noted = [json.loads(line) for line in Path(sys.argv[1]).read_text().splitlines()]
    figures = newest(Figure, "name", noted)
    soaks = newest(Soak, "soak", noted)
    content = {
        "machine": machine(),
        "figures": [asdict(f) for f in figures],
        "soak": [asdict(s) for s in soaks],
    }
    (DOCS / "safety-figures.md").write_text(table(figures, soaks, content["machine"]))
    (DOCS / "safety-figures.json").write_text(json.dumps(content, indent=2) + "\n")
    subprocess.run([sys.executable, FIRST_PAGE], check=True)


if __name__ == "__main__":
    main()
