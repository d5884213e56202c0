"""Write the tables of the last results into the documentation.

Run as ``python -m benchmarks.tables``; reads ``results/*.json`` and writes
``docs/explanation/performance-figures.inc``, in the order of the benchmarks. Rough
results are not used.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.__main__ import ROWS
from benchmarks.harness import RESULTS, Comparison

PAGE = Path(__file__).parents[1] / "docs" / "explanation" / "performance-figures.inc"


def tables(results: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the tables of results, by name of the benchmark, as Markdown."""
    parts = []
    for row in ROWS:
        if row.name not in results:
            continue
        result = results[row.name]
        machine = result["machine"]
        versions = ", ".join(
            f"{name} {number}"
            for name, number in machine["versions"].items()
            if number != "not installed"
        )
        parts.append(
            f"**{row.name}**: {machine['date']}, {machine['cores']} cores "
            f"({machine['processor']}), {machine['system']}, Python "
            f"{machine['python']}, {versions}; "
            f"load before {machine['load before']:.1f}."
        )
        parts += [
            Comparison(each["title"], each["runs"]).table()
            for each in result["comparisons"]
        ]
    return "\n\n".join(parts) + "\n"


def main() -> None:
    """Write the file."""
    files = {path.stem: path for path in RESULTS.glob("*.json")}
    results = {
        name: json.loads(path.read_text(encoding="utf-8"))
        for name, path in files.items()
    }
    PAGE.write_text(tables(results), encoding="utf-8")
    print(f"written to {PAGE}")


if __name__ == "__main__":
    main()
