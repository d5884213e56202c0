"""The summary at the end of all tests, and the results that it is made from."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT / "tools"))

from run_tests import Part, complaints, repeat, summary  # noqa: E402


def part(name, *outcomes, status=0):
    made = Part(name, seconds=65.0, status=status)
    for test, outcome, *why in outcomes:
        made.add(test, outcome, *(why or [""]), seconds=len(made.outcomes))
    return made


GOOD = part("test-web", ("a.test.js::a", "passed"))


def test_a_run_without_failures_says_so_with_counts_and_times():
    text = summary([GOOD, part("lint")], 131.0)
    assert "test-web    1:05       0:00       1       0        0" in text
    assert "lint        1:05       0:00  passed" in text
    assert text.endswith("Passed in 2:11 min.\ntests: 1 passed, 0 failed, 0 skipped")


def test_each_failure_is_named_with_the_command_that_repeats_it():
    failed = part("test-plain", ("tests/test_a.py::test_b[c d]", "failed"), status=1)
    text = summary([GOOD, failed], 1.0)
    assert "  tests/test_a.py::test_b[c d]\n" in text
    assert "      .venv/bin/pytest 'tests/test_a.py::test_b[c d]'\n" in text
    assert text.endswith("tests: 1 passed, 1 failed, 0 skipped")


def test_a_part_without_tests_that_fails_is_repeated_as_a_whole():
    text = summary([GOOD, part("types", status=2)], 1.0)
    assert "types       1:05       0:00  failed" in text
    assert "      make types\n" in text
    assert text.endswith("tests: 1 passed, 1 failed, 0 skipped")


def test_a_part_that_fails_although_all_its_tests_passed_is_named():
    low = part("test-gate", ("tests/test_a.py::test_a", "passed"), status=1)
    assert "      make test-gate\n" in summary([low], 1.0)


def test_skipped_tests_are_counted_by_their_reasons():
    skipped = [(f"tests/test_a.py::test_{n}", "skipped", "no ROS") for n in range(2)]
    assert "  no ROS (2 tests)" in summary([part("test-plain", *skipped)], 1.0)


def test_a_test_that_passes_when_it_runs_again_has_passed_and_is_listed():
    twice = part("test-time", ("t.py::a", "failed"), ("t.py::a", "passed"))
    text = summary([twice], 1.0)
    assert "Failed at first and passed when they ran again, alone:\n  t.py::a\n" in text
    assert text.endswith("tests: 1 passed, 0 failed, 0 skipped")


def test_the_longest_tests_are_listed_first_with_their_times():
    parts = [part("test-time", *((f"t.py::{n}", "passed") for n in range(12)))]
    longest = summary(parts, 1.0).partition("The longest:\n")[2].splitlines()
    assert longest[:2] == ["   11.0 s  t.py::11", "   10.0 s  t.py::10"]
    assert longest[10] == ""


def test_a_test_in_node_is_repeated_by_its_name():
    expected = "node --test --test-name-pattern 'a b' tests/a.test.js"
    assert repeat("tests/a.test.js::a b") == expected


def test_a_machine_with_one_processor_or_a_slow_one_is_told_what_follows():
    assert complaints(2, 0.1) == []
    (one,) = complaints(1, 0.1)
    assert "may use 1 processor" in one
    (slow,) = complaints(2, 1.5)
    assert "a loop took 1.5 s" in slow


@pytest.mark.slow
def test_pytest_writes_the_outcome_of_each_test(tmp_path):
    (tmp_path / "conftest.py").symlink_to(ROOT / "tests" / "conftest.py")
    (tmp_path / "test_it.py").write_text(
        "import pytest\n"
        "def test_good(): pass\n"
        "def test_bad(): assert not 1\n"
        "@pytest.fixture\n"
        "def broken(): raise OSError\n"
        "def test_broken(broken): pass\n"
        "def test_left_out(): pytest.skip('no ROS')\n"
    )
    results = tmp_path / "results.jsonl"
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-n", "2", f"--results={results}", "."],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT / "tests")},
        capture_output=True,
        check=False,
    )
    lines = [json.loads(line) for line in results.read_text().splitlines()]
    assert len(lines) == 4
    assert all(line["seconds"] >= 0 for line in lines)
    found = {line["test"]: (line["outcome"], line["why"]) for line in lines}
    assert found == {
        "test_it.py::test_good": ("passed", ""),
        "test_it.py::test_bad": ("failed", ""),
        "test_it.py::test_broken": ("failed", ""),
        "test_it.py::test_left_out": ("skipped", "no ROS"),
    }


def test_node_writes_the_outcome_of_each_test(tmp_path):
    (tmp_path / "package.json").write_text('{"type": "module"}')
    (tmp_path / "a.test.js").write_text(
        'import test from "node:test";\n'
        'test("good", () => {});\n'
        'test("bad", () => { throw new Error("no"); });\n'
        'test("left out", { skip: "no ROS" }, () => {});\n'
    )
    results = tmp_path / "results.jsonl"
    reporter = [
        f"--test-reporter={ROOT / 'tools/node_results.js'}",
        f"--test-reporter-destination={results}",
    ]
    subprocess.run(
        ["node", "--test", *reporter, "a.test.js"],
        cwd=tmp_path,
        capture_output=True,
        check=False,
    )
    lines = [json.loads(line) for line in results.read_text().splitlines()]
    assert all(line.pop("seconds") > 0 for line in lines)
    assert lines == [
        {"test": "a.test.js::good", "outcome": "passed", "why": ""},
        {"test": "a.test.js::bad", "outcome": "failed", "why": ""},
        {"test": "a.test.js::left out", "outcome": "skipped", "why": "no ROS"},
    ]
