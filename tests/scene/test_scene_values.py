import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.base.errors import SceneError
from webmap.scene.allowed import format_number, format_value


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.2, "0.2"), (5.0, "5"), (-0.0, "0"), (0.1 + 0.2, "0.3"), (58.7, "58.7")],
)
def test_numbers_are_short(value, text):
    assert format_number(value) == text


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_keeps_nine_digits(value):
    assert math.isclose(float(format_number(value)), value, rel_tol=1e-8)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_are_finite(value):
    with pytest.raises(SceneError, match="finite"):
        format_value("r", value)


def test_points_are_pairs():
    assert format_value("points", [(0, 0), (1.5, -2)]) == "0,0 1.5,-2"


def test_a_view_box_is_a_row_of_numbers():
    assert format_value("viewBox", (0, 0, 10, 20)) == "0 0 10 20"


def test_true_and_false_depend_on_the_attribute():
    assert format_value("disabled", True) == ""
    assert format_value("disabled", False) is None
    assert format_value("aria-pressed", False) == "false"


def test_what_has_no_text_is_refused():
    with pytest.raises(SceneError, match="cannot make"):
        format_value("r", object())
    with pytest.raises(SceneError, match="cannot hold"):
        format_value("points", [None])
