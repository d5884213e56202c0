"""Scan assist: the robot slows down before obstacles in the scan."""

import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.base.geometry import Twist
from webmap.base.outline import polygon_around
from webmap.config.motion import ScanAssistConfig
from webmap.gate.events import Scan
from webmap.gate.rules.assist import assist, free_way, inside, points_of

BOX = ((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2))
SPEC = ScanAssistConfig(topic="/scan", footprint=BOX)
BEAMS = 360


def sweep_of(distance_at, arrived=0.0, **more):
    """A scan all around from the base's origin: bearing in radians to a range."""
    step = math.tau / BEAMS
    ranges = [distance_at(-math.pi + ray * step) for ray in range(BEAMS)]
    about = {"angle_min": -math.pi, "angle_increment": step}
    return Scan(**about, range_min=0.05, range_max=8.0, ranges=ranges, arrived=arrived)


def wall(distance, facing=0.0):
    """A straight wall, ``distance`` metres from the base towards ``facing``."""

    def reach(bearing):
        toward = math.cos(bearing - facing)
        return distance / toward if toward > 1e-3 else math.inf

    return reach


NOTHING = sweep_of(lambda bearing: math.inf)


def test_a_scan_without_obstacles_does_not_reduce_the_velocity():
    assert assist(SPEC, NOTHING, Twist(1.0, 0.0, 0.3), 0.1).scale == 1.0


def test_a_zero_velocity_is_allowed_without_a_scan():
    assert assist(SPEC, None, Twist(0.0, 0.0, 0.0), 0.1).scale == 1.0


def test_the_distance_to_a_wall_is_measured_from_the_footprint():
    points = points_of(SPEC, sweep_of(wall(2.3)))
    assert free_way(BOX, points, Twist(1.0, 0.0, 0.0)) == pytest.approx(2.0)
    assert free_way(BOX, points, Twist(-1.0, 0.0, 0.0)) == math.inf


def test_a_point_beside_a_straight_path_is_no_obstacle():
    assert free_way(BOX, [(2.0, 0.21)], Twist(1.0, 0.0, 0.0)) == math.inf
    assert free_way(BOX, [(2.0, 0.19)], Twist(1.0, 0.0, 0.0)) == pytest.approx(1.7)


def test_only_a_point_on_the_curved_path_is_an_obstacle():
    ahead, aside = (0.0, 2.0), (2.0, 0.0)
    turning = Twist(1.0, 0.0, 1.0)  # on a circle of 1 m about (0, 1)
    met = free_way(BOX, [ahead], turning)
    assert 2.0 < met < math.pi
    assert free_way(BOX, [aside], turning) == math.inf


def test_a_turn_on_the_spot_respects_the_corners_of_the_footprint():
    outer = math.hypot(0.3, 0.2)
    assert free_way(BOX, [(0.0, outer - 0.01)], Twist(0.0, 0.0, 1.0)) < math.pi / 2
    assert free_way(BOX, [(0.0, outer + 0.01)], Twist(0.0, 0.0, 1.0)) == math.inf


def test_a_nearer_wall_reduces_the_velocity_further_down_to_zero():
    scales = [
        assist(SPEC, sweep_of(wall(0.3 + gap)), Twist(1.0, 0.0, 0.0), 0.1).scale
        for gap in (0.1, 0.3, 0.6, 1.0, 3.0)
    ]
    assert scales == sorted(scales)
    assert scales[0] == 0.0
    assert scales[-1] == 1.0


def test_a_robot_too_near_to_a_wall_may_only_drive_away():
    near = sweep_of(wall(0.35))
    assert assist(SPEC, near, Twist(0.5, 0.0, 0.0), 0.1).scale == 0.0
    assert assist(SPEC, near, Twist(-0.5, 0.0, 0.0), 0.1).scale == 1.0


@pytest.mark.parametrize("stated", [math.nan, 0.0, 0.1, -1.0])
def test_a_wrong_range_max_does_not_hide_a_wall(stated):
    near = msgspec.structs.replace(sweep_of(wall(0.35)), range_max=stated)
    assert assist(SPEC, near, Twist(0.5, 0.0, 0.0), 0.1).scale == 0.0


def test_points_on_the_robot_itself_are_no_obstacle():
    body = sweep_of(lambda bearing: 0.15 if abs(bearing) < 0.3 else math.inf)
    assert assist(SPEC, body, Twist(1.0, 0.0, 0.0), 0.1).scale == 1.0


def test_an_upside_down_scanner_swaps_left_and_right():
    """A wall to the robot's left: a scanner upside down finds it at its right."""
    left = sweep_of(lambda b: 0.45 if 0.3 < b < 2.0 else math.inf)
    right = sweep_of(lambda b: 0.45 if 0.3 < -b < 2.0 else math.inf)
    hanging = msgspec.structs.replace(SPEC, upside_down=True)
    to_the_left = Twist(0.3, 0.3, 0.0)
    assert assist(SPEC, left, to_the_left, 0.1).scale < 1.0
    assert assist(SPEC, right, to_the_left, 0.1).scale == 1.0
    assert assist(hanging, right, to_the_left, 0.1) == assist(
        SPEC, left, to_the_left, 0.1
    )
    assert assist(hanging, left, to_the_left, 0.1).scale == 1.0


def test_a_range_of_minus_infinity_is_an_obstacle():
    spec = ScanAssistConfig(topic="/scan", footprint=BOX, x=0.3)
    near = sweep_of(lambda bearing: -math.inf if abs(bearing) < 0.5 else math.inf)
    assert assist(spec, near, Twist(0.2, 0.0, 0.0), 0.1).scale == 0.0


@pytest.mark.parametrize(
    ("sweep", "why"),
    [
        (None, "no scan yet"),
        (sweep_of(lambda b: math.inf, arrived=-0.5), "old"),
        (sweep_of(lambda b: math.inf, arrived=9.0), "old"),
        (sweep_of(lambda b: math.nan), "unknown"),
        (sweep_of(lambda b: 0.0), "unknown"),
        (sweep_of(lambda b: math.nan if abs(b) < 0.6 else math.inf), "unknown"),
        (Scan(math.nan, 0.1, 0.1, 8.0, [1.0] * 10, 0.0), "no angles"),
        (Scan(0.0, 0.0, 0.1, 8.0, [math.inf] * 10, 0.0), "no angles"),
        (Scan(0.0, 0.1, 0.1, 8.0, [], 0.0), "does not cover the direction"),
        (Scan(2.0, 0.01, 0.1, 8.0, [1.0] * 10, 0.0), "does not cover the direction"),
    ],
)
def test_a_robot_without_a_usable_scan_stops_or_creeps_as_configured(sweep, why):
    wanted = Twist(0.5, 0.0, 0.0)
    stop = assist(SPEC, sweep, wanted, 0.1)
    assert stop.scale == 0.0
    assert why in stop.why
    creeping = ScanAssistConfig(topic="/scan", footprint=BOX, blind="creep")
    assert assist(creeping, sweep, wanted, 0.1).scale == pytest.approx(0.2)
    assert assist(creeping, sweep, Twist(0.05, 0.0, 0.0), 0.1).scale == 1.0


def test_a_scan_of_the_front_prevents_driving_backwards():
    front = Scan(-1.5, 0.01, 0.05, 8.0, [math.inf] * 300, 0.0)
    assert assist(SPEC, front, Twist(0.5, 0.0, 0.0), 0.1).scale == 1.0
    assert assist(SPEC, front, Twist(-0.5, 0.0, 0.0), 0.1).scale == 0.0


@given(
    distance=st.floats(0.35, 5.0),
    speed=st.floats(0.05, 2.0),
    facing=st.floats(-0.9, 0.9),
    turn=st.floats(-1.0, 1.0),
)
def test_a_robot_with_scan_assist_never_touches_a_wall(distance, speed, facing, turn):
    # The assumed worst case: full speed for the whole reaction time, then braking.
    gap_at_start = distance - max(
        x * math.cos(facing) + y * math.sin(facing) for x, y in BOX
    )
    if gap_at_start <= 0:
        return
    wanted = Twist(speed, 0.0, turn)
    sweep = sweep_of(wall(distance, facing))
    scale = assist(SPEC, sweep, wanted, 0.1).scale
    v, w = speed * scale, turn * scale
    way = v * 0.2 + v * v / (2 * SPEC.brake)
    x = y = yaw = 0.0
    for _ in range(200):
        if v == 0:
            break
        dt = way / v / 200
        x, y = x + v * dt * math.cos(yaw), y + v * dt * math.sin(yaw)
        yaw += w * dt
        for cx, cy in BOX:
            px = x + cx * math.cos(yaw) - cy * math.sin(yaw)
            py = y + cx * math.sin(yaw) + cy * math.cos(yaw)
            reach = px * math.cos(facing) + py * math.sin(facing)
            # A tolerance, because the wall is not seen between two rays.
            assert reach < distance + 0.02


@given(st.floats(-2, 2), st.floats(-2, 2))
def test_inside_is_true_only_for_points_in_the_box(x, y):
    if abs(abs(x) - 0.3) > 1e-9 and abs(abs(y) - 0.2) > 1e-9:
        assert inside(BOX, (x, y)) == (abs(x) < 0.3 and abs(y) < 0.2)


@given(st.floats(0.05, 2.0), st.floats(0, math.tau))
def test_the_polygon_around_a_disc_contains_the_disc(radius, angle):
    edge = (0.999 * radius * math.cos(angle), 0.999 * radius * math.sin(angle))
    assert inside(polygon_around(radius), edge)


def test_a_point_in_line_with_the_side_of_the_robot_is_an_obstacle():
    assert free_way(BOX, [(2.0, 0.2)], Twist(1.0, 0.0, 0.0)) == pytest.approx(1.7)


def test_the_free_way_to_a_point_on_the_footprint_edge_is_zero():
    on_edge = [(0.3, y / 100) for y in range(-19, 20)]
    for point in on_edge:
        met = free_way(BOX, [point], Twist(0.5, 0.0, 0.5))
        assert met == pytest.approx(0, abs=1e-6)


def test_a_turn_on_the_spot_needs_a_scan_of_all_directions():
    blind = sweep_of(lambda bearing: math.nan if abs(bearing) > 1 else math.inf)
    assert assist(SPEC, blind, Twist(0.0, 0.0, 0.5), 0.1).scale == 0.0
    assert assist(SPEC, blind, Twist(0.3, 0.0, 0.0), 0.1).scale == 1.0
