"""docs/safety.md and README.md name tests that exist and the newest figures."""

import re

from safety_figures import DOCS, Figure
from safety_promises import PAGE as FILE
from safety_promises import (
    PROMISES,
    README,
    in_short,
    kept_figures,
    promise_table,
    worst,
)

from equipment.named_tests import names_of_tests

PAGE = FILE.read_text()
TESTS = DOCS.parent / "tests"


def test_every_test_named_in_the_safety_document_exists():
    named = set(re.findall(r"`(test_\w+)`", PAGE))
    assert len(named) > 30, "the page names hardly any test"
    assert named - names_of_tests() == set()


def test_every_test_file_named_in_the_safety_document_exists():
    named = set(re.findall(r"`((?:tests/[\w/]+/)?test_\w+\.py)`", PAGE))
    assert named
    there = {path.name for path in TESTS.rglob("test_*.py")}
    assert {name.rsplit("/", 1)[-1] for name in named} - there == set()


NUMBERS = list(range(1, 22))


def test_every_promise_names_a_test_and_no_promise_is_missing():
    """Each promise is a term with a number, and a definition that names its tests."""
    begin = PAGE.index("## What is promised")
    promised = PAGE[begin : PAGE.index("## What is not promised", begin)]
    promises = re.findall(r"\n([A-Z][^\n]+)\n: (.*?)(?=\n\n)", promised, re.DOTALL)
    numbers = [int(n) for term, _ in promises for n in re.findall(r"\bS(\d+)", term)]
    assert sorted(numbers) == NUMBERS
    without = [term for term, text in promises if not re.search("`test_", text)]
    assert without == []


def test_the_table_shows_every_promise_with_its_newest_figure_and_its_test():
    assert sorted({promise.number for promise in PROMISES}) == NUMBERS
    assert {promise.shown_by for promise in PROMISES} - names_of_tests() == set()
    assert promise_table(kept_figures()) in PAGE, (
        "run python tests/safety/safety_promises.py"
    )


def test_the_readme_shows_five_promises_with_the_figures_of_the_table():
    lines = in_short(kept_figures())
    assert lines.count("\n") == 5
    assert lines in README.read_text(), "run python tests/safety/safety_promises.py"
    rows = promise_table(kept_figures())
    for number, figure in re.findall(r"S(\d+): .+ measured: (.+)\.\n", lines):
        assert re.search(rf"\| S{number} \| .* \| {re.escape(figure)} \|", rows)


def test_every_figure_pattern_of_a_promise_matches_a_figure():
    names = [figure.name for figure in kept_figures()]
    patterns = [promise.figures for promise in PROMISES if promise.figures]
    found = {p for p in patterns for name in names if re.fullmatch(p, name)}
    assert set(patterns) - found == set()


def test_the_table_shows_the_worst_figure_and_marks_a_missed_limit():
    stop = next(p for p in PROMISES if p.number == 8)
    figure = Figure("STOP by the space bar while W is held", "zero", 0.1, 0.017, 0, 50)
    assert worst(stop, [figure]) == f"17 of 100 ms: {figure.name}"
    late = Figure(figure.name, "zero", 0.1, 0.203, 0, 50)
    assert worst(stop, [figure, late]) == f"203 of 100 ms, **missed**: {figure.name}"
    assert worst(stop, []) == "shown by the test"
