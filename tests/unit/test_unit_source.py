"""What holds for every file of the project."""

import ast
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = sorted((ROOT / "src").rglob("*.py"))
# A path of somebody's machine: a home, a checkout, the root's own folder.
MACHINE_PATH = re.compile(
    r"(?<![\w./*])(?:/(?:home|Users)/\w+/|/(?:root|work)/\w|[A-Z]:\\Users\\\w)"
)


def project_files() -> list[Path]:
    """Return what git knows of, or everything where there is no git (an sdist)."""
    names: list[str] = []
    if (ROOT / ".git").exists() and (git := shutil.which("git")):
        done = subprocess.run(
            [git, "ls-files", "-z"],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=True,
        )
        names = done.stdout.split("\0")[:-1]
    files = [ROOT / name for name in names] or list((ROOT / "src").rglob("*"))
    return [path for path in files if path.is_file()]


def test_every_source_file_says_what_it_is_for() -> None:
    silent = [
        str(path.relative_to(ROOT))
        for path in SOURCES
        if not ast.get_docstring(ast.parse(path.read_text("utf-8")))
    ]
    assert not silent


def test_no_file_names_a_path_of_a_machine() -> None:
    found = []
    for path in project_files():
        try:
            text = path.read_text("utf-8")
        except UnicodeDecodeError:
            continue
        found += [
            f"{path.relative_to(ROOT)}: {match[0]}"
            for match in MACHINE_PATH.finditer(text)
        ]
    assert not found


# In pieces, so that this file names none itself.
@pytest.mark.parametrize("parts", [("/home", "ann", "x"), ("cd /root", "a")])
def test_a_path_of_a_machine_would_be_seen(parts: tuple[str, ...]) -> None:
    assert MACHINE_PATH.search("/".join(parts))
