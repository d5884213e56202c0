"""The names of buttons that the documentation prints in bold."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted([*DOCS.glob("*.md"), *DOCS.glob("[hrt]*/*.md")])
"""The pages whose bold words are buttons: how-to, reference, tutorial and others."""

NO_BUTTON = {
    *("Ctrl+K", "LB", "left shoulder button", "left stick", "right stick"),
    *("release it to stop", "speed limit", "moves"),
}
"""Bold words that are keys, or stress a part of a sentence."""


def bold(page: Path) -> set[tuple[str, str]]:
    """Return the topic of the section, and each bold text that names something."""
    found, topic = set(), page.stem if page.parent.name == "howto" else ""
    for line in page.read_text("utf-8").splitlines():
        if line.startswith("## ") and page.stem.startswith("manual"):
            topic = line.removeprefix("## ").strip().casefold()
        texts = re.findall(r"\*\*(.+?)\*\*", line)
        found |= {(topic, text) for text in texts if not text.endswith((".", ":"))}
    return {(topic, text) for topic, text in found if text not in NO_BUTTON}
