"""The tests that only ``make test-all`` runs, and those that cover their subjects."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from equipment.named_tests import functions
from thorough import THOROUGH, is_thorough, keys

ROOT = Path(__file__).parents[2]


def covering(file: str, by: str) -> str:
    """Return the test that the list names, with its file."""
    return by if by.startswith("tests/") else f"{file}::{by}"


@pytest.fixture(scope="module")
def tests() -> set[str]:
    """Return the ids of the tests in all files that the list names."""
    others = {
        covering(file, by).partition("::")[0]
        for file, covered in THOROUGH.items()
        for by in covered.values()
    }
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "--no-header"]
    listed = subprocess.run(
        [*command, "--", *sorted(others | THOROUGH.keys())],
        cwd=ROOT,
        env=os.environ,
        capture_output=True,
        text=True,
        check=True,
    )
    return {line for line in listed.stdout.splitlines() if "::" in line}


def full_keys(test: str) -> set[str]:
    return {f"{test.partition('::')[0]}::{key}" for key in keys(test)}


@pytest.mark.slow
def test_each_thorough_test_exists_and_another_test_covers_its_subject(tests):
    there = set().union(*map(full_keys, tests))
    kept = set().union(*(full_keys(t) for t in tests if not is_thorough(t)))
    for file, covered in THOROUGH.items():
        for name, by in covered.items():
            assert f"{file}::{name}" in there
            assert covering(file, by) in kept, f"{file}::{name} names {by}"


def test_make_test_covers_each_test_that_a_promise_names():
    page = (ROOT / "docs/safety.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(test_\w+)`", page))
    kept = {name for file, name in functions() if not is_thorough(f"{file}::{name}")}
    assert named - kept == {"test_no_sequence_of_events_breaks_a_safety_promise"}
