"""Scan assist checks whether the scan covers the path of the robot."""

import math
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.base.geometry import Twist
from webmap.base.outline import polygon_around
from webmap.config.motion import ScanAssistConfig
from webmap.gate.events import Scan
from webmap.gate.rules.assist import assist
from webmap.gate.rules.scan_geometry import ScanDirections, looks_ahead

BOX = ((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2))
PART = "scan assist: the scan covers only a part of the path"
AHEAD = Twist(0.5)


def spec(sensor=(0.0, 0.0, 0.0), **more):
    x, y, yaw = sensor
    pose = {"x": x, "y": y, "angle": math.degrees(yaw)}
    return ScanAssistConfig(**{"topic": "/scan", "footprint": BOX, **pose, **more})


def scan(first, last, *, step=1.0):
    """A scan without obstacles between two angles in degrees."""
    count = round((last - first) / step) + 1
    ranges = [math.inf] * count
    low, each = math.radians(first), math.radians(step)
    return Scan(low, each, 0.05, 8.0, ranges, 0.0)


def verdict(sweep, wanted, **more):
    return assist(spec(**more), sweep, wanted, 0.1)


class TestAhead:
    def test_a_scan_of_the_front_allows_driving_ahead(self):
        for half in (180, 135, 90, 60):
            assert verdict(scan(-half, half), AHEAD).scale == 1.0

    def test_a_narrow_scan_does_not_allow_driving_ahead(self):
        found = verdict(scan(-20, 20), AHEAD)
        assert (found.scale, found.why) == (0.0, PART)
        assert verdict(scan(-20, 20), AHEAD, blind="creep").scale == pytest.approx(0.2)

    def test_a_scan_of_one_side_does_not_allow_driving_ahead(self):
        # The scan covers most of the path, without obstacles.
        assert verdict(scan(-90, 5), AHEAD).why == PART
        assert verdict(scan(-5, 90), AHEAD).why == PART

    def test_a_scan_with_a_gap_ahead_allows_driving_backwards_only(self):
        assert verdict(scan(15, 345), AHEAD).why == PART
        assert verdict(scan(15, 345), Twist(-0.5)).scale == 1.0

    def test_the_position_and_direction_of_the_scanner_count(self):
        behind = (-0.3, 0.0, math.pi)
        assert verdict(scan(-90, 90), AHEAD, sensor=behind).scale == 0.0
        assert verdict(scan(90, 270), AHEAD, sensor=behind).scale == 1.0
        # A scanner at the front of the robot needs a wider scan.
        assert verdict(scan(-35, 35), AHEAD).scale == 1.0
        assert verdict(scan(-35, 35), AHEAD, sensor=(0.3, 0.0, 0.0)).why == PART

    def test_the_scan_need_not_cover_the_path_within_the_stop_distance(self):
        front = (0.3, 0.0, 0.0)
        assert verdict(scan(-60, 60), AHEAD, sensor=front).scale == 1.0
        near = verdict(scan(-60, 60), AHEAD, sensor=front, stop_distance=0.05)
        assert near.why == PART

    def test_a_scan_with_a_negative_angle_increment_is_supported(self):
        there = scan(-90, 90)
        back = Scan(
            -there.angle_min, -there.angle_increment, 0.05, 8.0, there.ranges, 0
        )
        assert verdict(back, AHEAD).scale == 1.0
        assert verdict(back, Twist(-0.5)).scale == 0.0


class TestOtherDirections:
    def test_driving_a_curve_needs_a_wider_scan_than_driving_straight(self):
        narrow = scan(-40, 40)
        assert verdict(narrow, Twist(0.5)).scale == 1.0
        assert verdict(narrow, Twist(0.5, 0.0, 1.2)).why == PART
        assert verdict(scan(-90, 90), Twist(0.5, 0.0, 1.2)).scale == 1.0

    def test_driving_backwards_or_sideways_needs_a_scan_in_that_direction(self):
        front = scan(-90, 90)
        assert verdict(front, Twist(-0.5)).scale == 0.0
        assert verdict(front, Twist(0.0, 0.5)).why == PART
        assert verdict(scan(-180, 180), Twist(0.0, 0.5)).scale == 1.0

    def test_turning_on_the_spot_needs_a_scan_of_half_the_circle(self):
        turn = Twist(0.0, 0.0, 0.5)
        assert verdict(scan(-90, 90), turn).scale == 1.0
        assert verdict(scan(-60, 60), turn).why == PART

    def test_scan_assist_takes_less_than_20_ms_for_one_command(self):
        round_one = spec(footprint=polygon_around(0.3))
        all_around = scan(-180, 179)
        begun = time.process_time()
        for _ in range(100):
            assist(round_one, all_around, Twist(2.0, 0.0, 1.5), 0.1)
        assert (time.process_time() - begun) / 100 < 0.02


class TestFan:
    @given(st.floats(-10, 10), st.floats(0.001, 0.5), st.integers(1, 400))
    def test_scan_directions_cover_every_ray_and_the_angle_to_the_next(
        self, first, step, count
    ):
        fan = ScanDirections(first, step, count)
        for ray in range(count):
            assert fan.covers(first + (ray + 0.4) * step)
            assert fan.covers(first + ray * step - math.tau)

    @given(st.floats(-math.pi, math.pi), st.floats(0.001, 0.1), st.floats(-0.9, 0.9))
    def test_scan_directions_do_not_cover_the_opposite_side(self, first, step, aside):
        fan = ScanDirections(first, step, 2)
        other = first + math.pi + aside * (math.pi - 0.4)
        assert not fan.covers(other)

    def test_a_full_circle_scan_covers_every_direction(self):
        fan = ScanDirections(-math.pi, math.radians(1), 360)
        assert fan.share == 1.0
        assert all(fan.covers(math.radians(angle / 3)) for angle in range(-999, 999))


def test_a_path_shorter_than_the_stop_distance_needs_no_scan():
    nothing = ScanDirections(3.0, 0.01, 1)
    assert looks_ahead(nothing, BOX, (0.0, 0.0, 0.0), AHEAD, 0.1, 0.15)
    assert not looks_ahead(nothing, BOX, (0.0, 0.0, 0.0), AHEAD, 1.0, 0.15)
