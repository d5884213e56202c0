"""The names that people state: short, plain, and unlike any other."""

import contextlib

import pytest

from webmap.core.operators import MOST_NAME, Operators, Viewer, likeness, plain_name

ANN, BEN = Viewer("v1"), Viewer("v2")
HERE = "10.0.0.5"


class Connection:
    def __init__(self):
        self.names = []

    def rename(self, name):
        self.names.append(name)


@pytest.fixture
def operators():
    return Operators()


@contextlib.contextmanager
def present(operators, *viewers, address=HERE):
    with contextlib.ExitStack() as open_pages:
        for viewer in viewers:
            open_pages.enter_context(operators.present(viewer, address))
        yield


def label(operators, viewer=ANN):
    return operators.of(viewer).label


def test_a_person_without_a_name_is_called_after_the_address(operators):
    assert label(operators) == "an operator (no name)"
    with present(operators, ANN, BEN):
        assert label(operators) == "an operator at 10.0.0.5 (no name)"
        assert label(operators, BEN) == "operator 2 at 10.0.0.5 (no name)"


def test_a_name_is_shown_with_the_place_or_else_the_address(operators):
    with present(operators, ANN):
        assert operators.rename(ANN, " Ana  María ", "") == ""
        assert label(operators) == "Ana María (10.0.0.5)"
        assert operators.rename(ANN, "Ana", "desk 4") == ""
        assert label(operators) == "Ana (desk 4)"
        operators.rename(ANN, "", "")
        assert label(operators) == "an operator at 10.0.0.5 (no name)"


@pytest.mark.parametrize(
    "name", ["Ana", "ANA", "A.n.a", "Ána", "\uff21\uff4e\uff41", "A\u200bna"]
)
def test_the_second_of_two_names_that_look_alike_gets_a_number(operators, name):
    with present(operators, ANN, BEN):
        operators.rename(ANN, "Ana", "desk 4")
        operators.rename(BEN, name, "Desk 4")
        assert label(operators) == "Ana (desk 4)"
        assert label(operators, BEN).endswith(" 2 (Desk 4)")


def test_a_number_written_by_a_person_is_not_the_number_of_another_one(operators):
    eve = Viewer("v3")
    with present(operators, ANN, BEN, eve):
        operators.rename(ANN, "Ana", "desk")
        operators.rename(eve, "Ana 2", "desk")
        operators.rename(BEN, "Ana", "desk")
        assert label(operators, BEN) == "Ana 3 (desk)"


def test_a_name_is_free_again_when_its_person_has_left(operators):
    with present(operators, ANN):
        operators.rename(ANN, "Ana", "")
    with present(operators, BEN):
        operators.rename(BEN, "Ana", "")
        assert label(operators, BEN) == "Ana (10.0.0.5)"
        with present(operators, ANN):
            assert label(operators) == "Ana 2 (10.0.0.5)"


@pytest.mark.parametrize(
    "name", ["you", " YOU ", "Y\u200bo\u202eu", "(you)", "Program"]
)
def test_a_name_that_pages_use_for_others_is_refused(operators, name):
    operators.rename(ANN, "Ana", "")
    assert "could not tell whose name" in operators.rename(ANN, name, "")
    assert label(operators) == "Ana"


@pytest.mark.parametrize("name", ["...", "\U0001f916", "!"])
def test_a_name_without_letters_and_digits_is_refused(operators, name):
    assert operators.rename(ANN, name, "") == "A name needs a letter or a digit."


def test_a_verified_name_cannot_be_changed(operators):
    ada = Viewer("a", "Ada")
    with present(operators, ada):
        assert "comes from the sign-in" in operators.rename(ada, "Eve", "")
        assert operators.of(ada).logged == label(operators, ada) == "Ada"
        assert operators.identity(ada, "p1").verified


def test_a_log_marks_a_name_that_is_not_verified(operators, caplog):
    caplog.set_level("INFO")
    operators.rename(ANN, "Ana", "desk")
    assert operators.of(ANN).logged == "Ana (desk) [name not verified]"
    assert "Ana (desk) [name not verified] from now on" in caplog.text


def test_all_connections_of_a_person_are_renamed_at_once(operators):
    one, other, left = Connection(), Connection(), Connection()
    with present(operators, ANN), operators.following(ANN, one):
        with operators.following(ANN, left):
            pass
        with operators.following(ANN, other):
            operators.rename(ANN, "Ana", "desk")
    operators.rename(ANN, "Eva", "desk")
    assert one.names[-1] == other.names[-1] == "Ana (desk)"
    assert left.names == ["an operator at 10.0.0.5 (no name)"]


def test_another_address_of_a_browser_changes_the_name_on_its_connections(operators):
    page = Connection()
    with (
        present(operators, ANN),
        operators.following(ANN, page),
        present(operators, ANN, address="10.0.0.6"),
    ):
        assert page.names[-1] == "an operator at 10.0.0.6 (no name)"


def test_only_viewers_without_a_page_are_forgotten(operators, monkeypatch):
    monkeypatch.setattr("webmap.core.operators.MOST_KNOWN", 3)
    with present(operators, ANN):
        operators.rename(ANN, "Ana", "")
        for number in range(9):
            with present(operators, Viewer(f"x{number}")):
                operators.rename(Viewer(f"x{number}"), f"Eve {number}", "")
        assert label(operators) == "Ana (10.0.0.5)"
    assert label(operators, Viewer("x8")) == "Eve 8 (10.0.0.5)"
    assert label(operators, Viewer("x0")) == "an operator (no name)"


def test_the_pages_of_one_person_share_an_identity(operators):
    one, other = (operators.identity(ANN, page) for page in ("p1", "p2"))
    assert one.person == other.person == operators.of(ANN).person
    assert one.page != other.page
    assert operators.identity(BEN, "p1").person != one.person
    assert "v1" not in one.person
    assert Operators().identity(ANN, "p1").person != one.person


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("Ana\n\tB\x00\x1b[31m", "Ana B[31m"),
        ("a\u202eb\u2066c\u200d\ufeff\u2069", "abc"),
        ("Ana (desk 4) \uff08x\uff09", "Ana desk 4 x"),
        ("\u3164\u115f\u2800", ""),
        ("\ud800x\ue000", "x"),
        ("<b>Ana</b>", "<b>Ana</b>"),
        ("x" * 200, "x" * (MOST_NAME - 1) + "\u2026"),
        ("\u05e8" * 200, "\u05e8" * (MOST_NAME - 1) + "\u2026"),
    ],
)
def test_a_name_is_one_short_line_in_which_every_character_shows(text, name):
    assert plain_name(text, MOST_NAME) == name
    assert len(plain_name(text, MOST_NAME)) <= MOST_NAME


def test_every_label_fits_where_the_gate_and_agents_keep_names(operators):
    with present(operators, ANN, BEN):
        for viewer in (ANN, BEN):
            operators.rename(viewer, "W" * 200, "M" * 200)
        assert len(label(operators, BEN)) <= 64


def test_names_that_look_alike_are_compared_by_letters_and_digits():
    assert likeness("An\u0301a-4 ") == likeness("\u00c1NA4") == "ana4"
