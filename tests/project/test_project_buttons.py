"""The names of buttons that the documentation prints in bold are on the page."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src" / "webmap"
PAGES = sorted(
    [*(ROOT / "docs").glob("manual*.md"), *(ROOT / "docs/howto").glob("*.md")]
)

NO_BUTTON = {
    *("Ctrl+K", "LB", "left shoulder button", "left stick", "right stick"),
    *("release it to stop", "speed limit"),
}
"""Bold words that are keys, or stress a part of a sentence."""


def bold(page: Path) -> set[tuple[str, str]]:
    """Return the topic of the section, and each bold text that names something."""
    found, topic = set(), page.stem
    for line in page.read_text("utf-8").splitlines():
        if line.startswith("## ") and page.stem.startswith("manual"):
            topic = line.removeprefix("## ").strip().casefold()
        texts = re.findall(r"\*\*(.+?)\*\*", line)
        found |= {(topic, text) for text in texts if not text.endswith((".", ":"))}
    return {(topic, text) for topic, text in found if text not in NO_BUTTON}


def labels(topic: str) -> str:
    """Return the code that makes the page of a topic.

    A topic with a folder of its own has no buttons of other features: **Run** is a
    button of a form, and no button of a route.
    """
    own = PACKAGE / "features" / topic
    features = own if own.is_dir() else PACKAGE / "features"
    folders = (features, PACKAGE / "console", PACKAGE / "web")
    files = (file for folder in folders for file in sorted(folder.rglob("*")))
    return "\n".join(
        file.read_text("utf-8")
        for file in files
        if file.suffix in (".js", ".py", ".html")
    )


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_each_button_that_the_documentation_names_is_on_the_page(page):
    missing = []
    for topic, name in sorted(bold(page)):
        # The whole text of an element or of a literal, and no name of a key.
        label = rf'(?<!key [!=]== )(?<!case )["\'>]{re.escape(name)}(?:["\'<]| <select)'
        if not re.search(label, labels(topic)):
            missing.append(f"{name} ({topic})")
    assert missing == []
