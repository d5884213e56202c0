"""The page on security names tests that exist, for each promise and each attacker."""

import re
from pathlib import Path

from equipment.named_tests import names_of_tests

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/explanation/security.md").read_text()


def rows(title):
    """Return the cells of the rows of the table below a title."""
    section = PAGE[PAGE.index(f"\n## {title}\n") :]
    lines = section[section.index("|---") :].split("\n\n")[0].splitlines()[1:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_every_test_named_on_the_page_on_security_exists():
    named = set(re.findall(r"`(test_\w+)`", PAGE))
    assert len(named) > 60
    assert named - names_of_tests() == set()


def test_every_promise_on_security_names_a_test():
    promises = rows("Promises")
    assert [number for number, _, _ in promises] == [f"X{n}" for n in range(1, 18)]
    assert [number for number, _, tests in promises if "`test_" not in tests] == []


def test_the_threat_model_states_what_stops_each_attacker_and_what_does_not():
    model = rows("Who could do harm, and what stops them")
    assert len(model) >= 10
    for who, can, stops, does_not in model:
        assert who
        assert can
        assert "`test_" in stops, who
        assert does_not, who
