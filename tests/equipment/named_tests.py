"""The names of all tests, for tests of the documents that name them."""

import re
from collections.abc import Iterator
from pathlib import Path

TESTS = Path(__file__).parents[1]
FUNCTION = re.compile(r"^ *(?:async )?def (test_\w+)\(", re.M)


def functions() -> Iterator[tuple[str, str]]:
    """Yield each function of a test: its file from the root on, and its name."""
    for path in TESTS.rglob("test_*.py"):
        file = path.relative_to(TESTS.parent).as_posix()
        for found in FUNCTION.finditer(path.read_text(encoding="utf-8")):
            yield file, found[1]


def names_of_tests() -> set[str]:
    """Return the names of all functions of tests."""
    return {name for _, name in functions()}
