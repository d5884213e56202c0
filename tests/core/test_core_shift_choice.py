"""Which entries of the shift log a person sees, and their CSV."""

import csv
import io

import pytest

from webmap.core.shift_choice import (
    FOR_ADMINS,
    SAME_SHIFT,
    SHIFT,
    Choice,
    csv_of,
    shift_began,
)
from webmap.core.shift_files import Entry

NOW = 1_000_000.0


def entry(ago=0.0, kind="note", **values):
    usual = {"time": "2026-11-29T08:00:00.000Z", "unix": NOW - ago, "text": "hello"}
    return Entry(kind=kind, **(usual | values))


def test_a_choice_of_a_browser_never_raises():
    assert Choice.of({}) == Choice("shift")
    assert Choice.of({"since": "x", "robot": 7, "person": None}) == Choice(
        "shift", robot="7"
    )
    assert len(Choice.of({"person": "x" * 10_000}).person) == 100


def test_entries_are_chosen_by_time_robot_person_and_kind():
    entries = [
        entry(90_000),
        entry(50_000, robot="r1"),
        entry(100, robot="r1", person="Ana"),
        entry(50, kind="stop", person="Ana"),
        entry(10, kind="page"),
    ]

    def chosen(**choice):
        found = Choice(**choice).chosen(entries, "viewer", NOW)
        return [entries.index(each) for each in found]

    assert chosen() == [2, 3]
    assert chosen(since="24") == [1, 2, 3]
    assert chosen(since="all") == [0, 1, 2, 3]
    assert chosen(since="all", robot="r1") == [1, 2]
    assert chosen(since="all", person="Ana", kind="stop") == [3]
    assert chosen(kind="page") == [4]
    assert chosen(kind="all") == [2, 3, 4]


@pytest.mark.parametrize("kind", sorted(FOR_ADMINS))
def test_only_admins_see_sign_ins_and_refusals(kind):
    entries = [entry(kind=kind)]
    for choice in (Choice(), Choice(kind=kind), Choice(kind="all")):
        assert choice.chosen(entries, "viewer", NOW) == []
        assert choice.chosen(entries, "operator", NOW) == []
        assert choice.chosen(entries, "admin", NOW) == entries


def test_a_shift_begins_at_the_last_hand_over_but_not_the_one_of_now():
    assert shift_began([], NOW) == NOW - SHIFT
    long_ago = entry(2 * SHIFT, kind="shift")
    assert shift_began([long_ago], NOW) == NOW - SHIFT
    last, new = entry(7200, kind="shift"), entry(SAME_SHIFT - 1, kind="shift")
    assert shift_began([long_ago, last, new], NOW) == NOW - 7200


@pytest.mark.parametrize(
    "text", ["=1+1", "+1", "-1", "@SUM(A1)", "  =1", '"=1', "a,b", "=a\"b'c,d"]
)
def test_no_cell_of_the_csv_is_a_formula_and_every_text_is_in_it(text):
    one = entry(text=text, person=text, place=text, robot_name=text, verified=False)
    head, row = csv.reader(io.StringIO(csv_of([one])))
    cells = dict(zip(head, row, strict=True))
    for name in ("text", "person", "place", "robot"):
        assert cells[name].lstrip("'") == text
        assert not cells[name].lstrip().startswith(("=", "+", "-", "@"))
    assert cells["verified"] == "no"
