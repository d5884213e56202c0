"""Counts in sentences."""

import pytest

from webmap.base.text import counted


@pytest.mark.parametrize(
    ("number", "text"), [(0, "0 robots"), (1, "1 robot"), (2, "2 robots")]
)
def test_only_a_count_of_one_is_singular(number, text):
    assert counted(number, "robot") == text
