"""The names of buttons, and the numbers of presses, that the documentation has."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted([*DOCS.glob("*.md"), *DOCS.glob("[hmrt]*/*.md")])
"""The pages whose bold words are buttons: manual, how-to, reference, tutorial, and
others."""

NO_BUTTON = {
    *("LB", "left shoulder button", "left stick", "right stick", "moves"),
}
"""Bold words that are keys, or stress a part of a sentence."""


def bold(page: Path) -> set[tuple[str, str]]:
    """Return the topic of the section, and each bold text that names something."""
    found, topic = set(), page.stem if page.parent.name == "howto" else ""
    for line in page.read_text("utf-8").splitlines():
        if line.startswith("## ") and page.parent.name == "manual":
            topic = line.removeprefix("## ").strip().casefold()
        texts = re.findall(r"\*\*(.+?)\*\*", line)
        found |= {(topic, text) for text in texts if not text.endswith((".", ":"))}
    return {(topic, text) for topic, text in found if text not in NO_BUTTON}


def rows_below(page: Path, line: str) -> list[list[str]]:
    """Return the cells of the first table of a page that follows a line."""
    text = page.read_text("utf-8").partition(f"\n{line}\n")[2]
    table = re.search(r"(?:^\|.*\n)+", text, re.M)
    assert table, f"no table follows {line}"
    lines = table[0].splitlines()[2:]
    return [[cell.strip() for cell in each.strip("|").split("|")] for each in lines]


PRESSES = {
    task: int(number)
    for task, number, _ in rows_below(
        DOCS / "manual" / "index.md", "## Presses for each task"
    )
}
"""The number of presses of each task of the manual."""
