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
def test_numbers_are_formatted_without_needless_digits(value, text):
    assert format_number(value) == text


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_formatted_number_keeps_nine_digits(value):
    assert math.isclose(float(format_number(value)), value, rel_tol=1e-8)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_non_finite_numbers_are_refused(value):
    with pytest.raises(SceneError, match="finite"):
        format_value("r", value)


def test_points_are_formatted_as_coordinate_pairs():
    assert format_value("points", [(0, 0), (1.5, -2)]) == "0,0 1.5,-2"


def test_a_view_box_is_formatted_as_four_numbers():
    assert format_value("viewBox", (0, 0, 10, 20)) == "0 0 10 20"


def test_the_text_of_a_boolean_depends_on_the_attribute():
    assert format_value("disabled", True) == ""
    assert format_value("disabled", False) is None
    assert format_value("aria-pressed", False) == "false"


def test_values_without_a_text_form_are_refused():
    with pytest.raises(SceneError, match="cannot make"):
        format_value("r", object())
    with pytest.raises(SceneError, match="cannot hold"):
        format_value("points", [None])
