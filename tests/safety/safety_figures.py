"""The figures of a run, and their table in the documentation.

The environment variable WEBMAP_SAFETY_FIGURES names a file. Each test appends its
figure to this file as a line of JSON when its scenario ends, so that an interrupted run
can continue. ``python tests/safety/safety_figures.py FILE`` writes
``docs/safety-figures.md`` and ``docs/safety-figures.json`` from it.
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
PROMISES = Path(__file__).with_name("safety_promises.py")
"""Writes the worst figures into docs/safety.md and README.md."""


@dataclass(frozen=True)
class Figure:
    """The measured times of one fault, in seconds."""

    name: str
    stops_by: str
    promised: float
    worst: float
    jitter: float
    trials: int
    version: str = field(default_factory=version)
    asked: int = TRIALS
    """The number of trials that the run was started with."""


@dataclass(frozen=True)
class Soak:
    """A result of the half hour under full load, in its unit."""

    soak: str
    unit: str
    promised: float | None
    measured: float
    version: str = field(default_factory=version)


def note(figure: Figure | Soak) -> None:
    """Append a figure to the file of figures, if there is one."""
    print(figure)
    if path := os.environ.get("WEBMAP_SAFETY_FIGURES"):
        with Path(path).open("a") as file:
            file.write(json.dumps(asdict(figure)) + "\n")


def machine() -> dict[str, Any]:
    """Return the properties of the machine that the figures depend on."""
    return {
        "processors": os.cpu_count(),
        "python": platform.python_version(),
        "kernel": f"{platform.system()} {platform.release()}",
    }


def table(figures: list[Figure], soaks: list[Soak], measured_on: dict[str, Any]) -> str:
    """Return the figures as tables in Markdown, and a line about the machine."""
    lines = [
        "---",
        "orphan: true",
        "---",
        "",
        "| fault while W is held | stopped by | promised | worst measured "
        "| delay of the machine | trials | version |",
        "|---|---|---|---|---|---|---|",
    ]
    by = {"zero": "zero", "itself": "command timeout", "key": "zero"}
    lines += [
        f"| {f.name} | {by[f.stops_by]} | {f.promised * 1000:.0f} ms "
        f"| {f.worst * 1000:.0f} ms | {f.jitter * 1000:.0f} ms | {f.trials} "
        f"| {f.version} |"
        for f in figures
    ]
    if soaks:
        lines += [
            "",
            "| half an hour under full load | promised | measured | version |",
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
    """Return the newest figure of each name, of one type."""
    return list({f[key]: type(**f) for f in noted if key in f}.values())


def main() -> None:
    """Write the tables and the figures into the documentation."""
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
    subprocess.run([sys.executable, PROMISES], check=True)


if __name__ == "__main__":
    main()
