"""The names of buttons that the documentation prints in bold are on the page."""

import re

import pytest

from equipment.doc_buttons import PAGES, ROOT, bold

PACKAGE = ROOT / "src" / "webmap"


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
        if not is_label(name, labels(topic)):
            missing.append(f"{name} ({topic})")
    assert missing == []


KEYS = {"Space", "Enter", "Esc"}


def test_each_button_that_a_text_of_the_code_names_is_on_the_page():
    """Texts of commands and of the page name buttons: *press Run stop test on ...*."""
    code, missing = labels(""), []
    for file in sorted(PACKAGE.rglob("*")):
        if file.suffix not in (".py", ".js", ".html"):
            continue
        # A text may go on in the next literal, and the page has tags in it.
        text = re.sub(r'"\s*\n\s*f?"|</?strong>', "", file.read_text("utf-8"))
        for found in re.findall(r"\b[Pp]ress(?:ed)? ([A-Z][^.,;:\"\n]*)", text):
            words = found.split()
            names = [" ".join(words[:count]) for count in range(1, 7)]
            if not KEYS & set(names) and not any(is_label(n, code) for n in names):
                missing.append(f"{found} ({file.name})")
    assert missing == []


def is_label(name, code):
    """Return whether a name is the text of an element or literal, and no key."""
    pattern = rf'(?<!key [!=]== )(?<!case )["\'>]{re.escape(name)}(?:["\'<]| <select)'
    return re.search(pattern, code) is not None
