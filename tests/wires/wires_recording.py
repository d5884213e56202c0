"""Recordings of the messages on all connections, and comparison with them.

A recording is a text of sections. ``WEBMAP_WIRES=write pytest tests/wires`` makes all
of them twice, and writes those that are the same; ``git diff`` then shows the changes.
"""

import difflib
import os
from pathlib import Path

import pytest

FOLDER = Path(__file__).with_name("recorded")
WRITES = os.environ.get("WEBMAP_WIRES") == "write"

MOST_LINES = 60
"""Lines of a difference that are shown."""

HEAD = "== "
"""The beginning of a section."""


def path_of(name: str) -> Path:
    """Return the file of a recording."""
    return FOLDER / f"{name}.txt"


def recorded(name: str) -> str:
    """Return a recording; empty if there is none."""
    file = path_of(name)
    return file.read_text("utf-8") if file.exists() else ""


def agreed(one: dict[str, str], other: dict[str, str]) -> dict[str, str]:
    """Return recordings that were made twice; a failure in place of one that differs.

    A recording without an earlier one is complete when no message comes for a while. On
    a busy machine that may be too early, and then the recording lacks its end.
    """
    return {
        name: text
        if text == other.get(name)
        else "it failed: it was not the same twice, so one of the recordings may lack "
        f"messages; record again on a quiet machine\n{_diff(text, other.get(name, ''))}"
        for name, text in one.items()
    }


def _diff(one: str, other: str) -> str:
    return "\n".join(difflib.unified_diff(one.splitlines(), other.splitlines(), n=1))


def compare(name: str, text: str) -> None:
    """Fail if a text is not the recording of that name, or record the text."""
    if WRITES:
        FOLDER.mkdir(exist_ok=True)
        path_of(name).write_text(text, "utf-8")
    elif text != recorded(name):
        pytest.fail(difference(name, text), pytrace=False)


def difference(name: str, text: str) -> str:
    """Describe how a text differs from the recording of that name."""
    lines = difflib.unified_diff(
        recorded(name).splitlines(),
        text.splitlines(),
        f"recorded/{name}.txt",
        "this run",
        lineterm="",
        n=2,
    )
    shown = list(lines)
    left = len(shown) - MOST_LINES
    if left > 0:
        shown[MOST_LINES:] = [f"... and {left} lines more"]
    return "\n".join(
        [
            f"{name}: the messages differ from the recording.",
            "If the change is intended: WEBMAP_WIRES=write pytest tests/wires",
            *shown,
        ]
    )


def sections(text: str) -> dict[str, str]:
    """Return the sections of a recording by their titles."""
    found: dict[str, str] = {}
    for part in f"\n{text}".split(f"\n{HEAD}")[1:]:
        title, _, body = part.partition("\n")
        found[title] = body.strip("\n")
    return found


def joined(parts: dict[str, str]) -> str:
    """Return sections as one text."""
    listed = [f"{HEAD}{title}\n{body}\n" for title, body in parts.items()]
    return "\n".join(listed)
