"""Valid and invalid outlines and addresses of a robot."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from equipment.gate_harness import spec
from webmap.base.errors import ConfigError
from webmap.base.outline import MOST_CORNERS, polygon_around, why_no_outline
from webmap.gate.specs import checked
from webmap.ros import names

BOX = ((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2))
HOOK = ((0, 0), (2, 0), (2, 2), (1, 2), (1, 1), (0, 1))


@pytest.mark.parametrize(
    "corners",
    [BOX, BOX[::-1], HOOK, polygon_around(0.3), polygon_around(20.0, MOST_CORNERS)],
)
def test_outlines_in_both_directions_and_concave_outlines_are_accepted(corners):
    assert why_no_outline(corners) is None


@pytest.mark.parametrize(
    ("corners", "why"),
    [
        ((), "expected 3 to 100 corners, got 0"),
        (BOX[:2], "expected 3 to 100 corners, got 2"),
        (polygon_around(1.0, MOST_CORNERS + 1), "3 to 100 corners, got 101"),
        ((*BOX[:3], (1e300, 0.0)), "within 1000 m of the robot's origin"),
        ((*BOX[:3], (0.0, -1001.0)), "within 1000 m of the robot's origin"),
        ((*BOX, BOX[0]), "corners 1 and 5 are the same point; leave one of them out"),
        ((BOX[0], BOX[0], *BOX[1:]), "corners 1 and 2 are the same point"),
        ((BOX[0], BOX[2], BOX[1], BOX[3]), "edge from corner 1 meets the edge from"),
        (((0, 0), (1, 0), (2, 0)), "the edge from corner 1 meets the edge from corner"),
        (((0, 0), (2, 0), (1, 0)), "the edge from corner 1 meets the edge from corner"),
        (((0, 0), (2, 0), (2, 1), (1, 0), (0, 1)), "corner 1 meets the edge from"),
        (((0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (1, -1)), "corner 1 meets the edge"),
        (((0, 0), (9e-3, 0), (9e-3, 9e-3)), "it has an area of 4.05e-05 m²; expected"),
    ],
)
def test_an_invalid_outline_is_refused_with_a_reason(corners, why):
    assert why in why_no_outline(corners)


@given(st.permutations(polygon_around(0.5, 7)))
def test_only_corners_in_order_around_the_robot_make_an_outline(corners):
    turns = [
        math.atan2(y, x) - math.atan2(corners[0][1], corners[0][0]) for x, y in corners
    ]
    steps = [round(turn % math.tau * 7 / math.tau) for turn in turns]
    is_round = steps in ([0, 1, 2, 3, 4, 5, 6], [0, 6, 5, 4, 3, 2, 1])
    assert (why_no_outline(corners) is None) == is_round


@pytest.mark.parametrize("key", ["bridge_url", "goal_url"])
def test_an_address_that_the_gate_has_no_lane_for_is_refused(monkeypatch, key):
    monkeypatch.setitem(names.DEFAULT_PORTS, "pigeon", 7)
    with pytest.raises(ConfigError, match="cannot move robots behind pigeon://loft"):
        checked(spec(**{key: "pigeon://loft"}))
