"""Scan assist folds a scan of many beams into 720 at most, and misses no obstacle."""

import math
from array import array

import cbor2
import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from webmap.base.geometry import Twist
from webmap.base.outline import polygon_around
from webmap.config.motion import ScanAssistConfig
from webmap.gate.events import Scan
from webmap.gate.lanes.scans import parse_scan
from webmap.gate.rules.assist import FREE, assist, free_way, points_of
from webmap.gate.rules.scan_geometry import LIMIT, MOST, folded

BOX = ((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2))
SPEC = ScanAssistConfig(topic="/scan", footprint=BOX)
AHEAD = Twist(1.0, 0.0, 0.0)
COUNTS = st.sampled_from([721, 722, 1439, 1440, 1441, 2000, 3600])
PROFILES = st.lists(
    st.one_of(
        st.floats(0.0, 9.0), st.sampled_from([math.inf, -math.inf, math.nan, 0.0])
    ),
    min_size=1,
    max_size=40,
)


def dense(ranges, *, low=-math.pi, span=math.tau, **more):
    about = {"range_min": 0.05, "range_max": 30.0, "arrived": 0.0, **more}
    return Scan(
        angle_min=low, angle_increment=span / len(ranges), ranges=ranges, **about
    )


def received(sweep):
    """Return a scan as the gate parses the message of a bridge."""
    numbers = cbor2.CBORTag(85, array("f", sweep.ranges).tobytes())
    fields = ("angle_min", "angle_increment", "range_min", "range_max")
    message = {field: getattr(sweep, field) for field in fields}
    message["ranges"] = numbers
    frame = cbor2.dumps({"op": "publish", "topic": "/scan", "msg": message})
    return parse_scan(frame, 0.0)[1]


def spread(profile, count, seed):
    """A scan of ``count`` beams with the values of the profile in irregular order."""
    return [profile[(ray * ray + seed * ray) % len(profile)] for ray in range(count)]


def hit(reach, sweep):
    return reach == -math.inf or sweep.range_min <= reach < math.inf


class TestFold:
    @pytest.mark.parametrize("count", [1, 719, 720])
    def test_a_scan_of_at_most_720_beams_is_not_folded(self, count):
        sweep = dense([1.0] * count)
        assert folded(sweep) is sweep

    @given(st.integers(721, LIMIT))
    @settings(max_examples=10, deadline=None)
    def test_a_folded_scan_has_at_most_720_beams(self, count):
        fold = folded(dense(array("f", [2.0]) * count))
        assert MOST / 2 <= len(fold.ranges) <= MOST
        assert len(points_of(SPEC, fold)) <= MOST
        assert sum(fold.fold.total) == count

    @given(PROFILES, COUNTS, st.integers(0, 99), st.sampled_from([1.0, -1.0]))
    @settings(max_examples=15, deadline=None)
    def test_folding_keeps_every_hit_at_its_distance_or_nearer(
        self, profile, count, seed, way
    ):
        """Each hit is at a folded beam, or between two, that are at least as near."""
        sweep = dense(spread(profile, count, seed), span=way * math.tau)
        fold = folded(sweep)
        each = fold.fold.each
        assert fold.angle_increment == sweep.angle_increment * each
        assert fold.angle_min == sweep.angle_min
        for ray, reach in enumerate(sweep.ranges):
            if hit(reach, sweep):
                low, rest = divmod(ray, each)
                assert fold.ranges[low] <= reach
                assert rest == 0 or fold.ranges[low + 1] <= reach

    @given(PROFILES, COUNTS, st.integers(0, 99))
    @settings(max_examples=15, deadline=None)
    def test_folding_adds_no_hits(self, profile, count, seed):
        """Each folded range is the range of a beam less than a step away."""
        sweep = dense(spread(profile, count, seed))
        fold = folded(sweep)
        each = fold.fold.each
        for ray, reach in enumerate(fold.ranges):
            beside = sweep.ranges[max(0, (ray - 1) * each + 1) : (ray + 1) * each]
            hits = [r for r in beside if hit(r, sweep)]
            assert reach == min(hits) if hits else not hit(reach, sweep)

    def test_a_folded_beam_without_a_hit_is_unknown_if_most_of_its_beams_are(self):
        nan, inf = math.nan, math.inf
        groups = [[nan, nan, inf], [inf, inf, nan], [nan, nan, 2.0], [-inf, nan, 1.0]]
        ranges = [r for group in groups for r in group] + [inf] * 1800
        fold = folded(dense(ranges))
        assert fold.fold.each == 3
        assert math.isnan(fold.ranges[0])
        # The hit at 2 m lies between the third and the fourth beam, which has -inf.
        assert fold.ranges[1:6] == [inf, 2.0, -inf, 1.0, inf]
        assert fold.fold.known[:4] == [1, 2, 1, 2]

    def test_a_mostly_unknown_scan_with_few_hits_is_unknown(self):
        ranges = [5.0 if ray % 10 == 0 else math.nan for ray in range(16_000)]
        assert "unknown" in assist(SPEC, received(dense(ranges)), AHEAD, 0.1).why

    def test_folding_keeps_obstacles_behind_points_on_the_robot_itself(self):
        ranges = [0.15, 0.19, 0.25, 0.6] * 1000
        fold = folded(dense(ranges))
        assert set(fold.ranges) <= {0.15, 0.19}
        points = points_of(SPEC, fold)
        assert len(points) == len(fold.ranges)
        # The nearest point of the ring at 0.6 m is at the edge of the path.
        corner = math.sqrt(0.6**2 - 0.2**2) - 0.3
        assert free_way(BOX, points, AHEAD) == pytest.approx(corner, abs=0.01)

    def test_a_folded_scan_covers_no_wider_angle_than_the_scan(self):
        narrow = math.radians(20)
        sweep = dense([math.inf] * 1000, low=-narrow, span=2 * narrow)
        assert "only a part of the path" in assist(SPEC, folded(sweep), AHEAD, 0.1).why
        wide = dense([math.inf] * 1000, low=-1.5, span=3.0)
        assert assist(SPEC, folded(wide), AHEAD, 0.1) == FREE


class TestRefused:
    def test_a_scan_of_too_many_beams_stops_the_robot_with_a_reason(self):
        sweep = received(dense(array("f", [5.0]) * (LIMIT + 1)))
        assert len(sweep.ranges) == 0
        verdict = assist(SPEC, sweep, AHEAD, 0.1)
        assert verdict.scale == 0.0
        assert verdict.why == (
            "scan assist: the scan has 100001 beams, more than 100000"
        )

    def test_folding_refuses_a_scan_of_too_many_beams(self):
        assert "more than" in folded(dense(array("f", [5.0]) * (LIMIT + 1))).refused

    def test_a_dense_scan_that_covers_more_than_two_turns_is_refused(self):
        sweep = received(dense([5.0] * 16_000, span=3 * math.tau))
        assert assist(SPEC, sweep, AHEAD, 0.1).why == (
            "scan assist: the 16000 beams of the scan cover more than two turns"
        )


class TestVerdict:
    def test_a_scan_of_16000_beams_gives_the_verdict_of_the_folded_scan(self):
        for gap in (0.1, 0.3, 0.6, 0.8, 1.0, 3.0):
            step = math.tau / 16_000
            ranges = []
            for ray in range(16_000):
                toward = math.cos(-math.pi + ray * step)
                ranges.append((0.3 + gap) / toward if toward > 0.1 else math.inf)
            sweep = dense(array("f", ranges))
            through_the_lane = received(sweep)
            assert len(through_the_lane.ranges) <= MOST
            found = assist(SPEC, through_the_lane, AHEAD, 0.1)
            assert found == assist(SPEC, folded(sweep), AHEAD, 0.1)
            whole = assist(SPEC, sweep, AHEAD, 0.1)
            assert found.scale == pytest.approx(whole.scale, abs=0.02)

    def test_a_thin_obstacle_anywhere_in_the_path_reduces_the_velocity(self):
        for aside in range(-19, 20):
            y = aside / 100
            ranges = array("f", [math.inf]) * 16_000
            at = math.atan2(y, 0.8)
            ranges[round((at + math.pi) / math.tau * 16_000)] = math.hypot(0.8, y)
            verdict = assist(SPEC, received(dense(ranges)), AHEAD, 0.1)
            assert 0 < verdict.scale < 0.7, y

    @given(
        profile=PROFILES,
        count=st.sampled_from([90, 360, 720, 1500]),
        seed=st.integers(0, 99),
        footprint=st.sampled_from([BOX, polygon_around(0.3), polygon_around(1.0, 5)]),
        sensor=st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-4, 4)),
        twist=st.builds(Twist, st.floats(-2, 2), st.floats(-2, 2), st.floats(-3, 3)),
        stop=st.floats(0.0, 0.5),
        brake=st.floats(0.1, 5.0),
    )
    @settings(max_examples=15, deadline=None)
    def test_leaving_out_distant_points_changes_no_verdict(
        self, profile, count, seed, footprint, sensor, twist, stop, brake
    ):
        spec = ScanAssistConfig(
            topic="/scan",
            footprint=footprint,
            x=sensor[0],
            y=sensor[1],
            angle=math.degrees(sensor[2]),
            stop_distance=stop,
            brake=brake,
        )
        sweep = folded(dense(spread(profile, count, seed)))
        found = assist(spec, sweep, twist, 0.1)
        speed = math.hypot(twist.vx, twist.vy) + abs(twist.wz) * max(
            math.hypot(x, y) for x, y in footprint
        )
        if speed == 0.0 or (found.why and "something" not in found.why):
            return  # not moving, or blind: no point is used
        gap = free_way(footprint, points_of(spec, sweep), twist) * speed
        room = gap - stop - 0.2 * speed
        allowed = math.sqrt(2 * brake * room) if room > 0 else 0.0
        assert found.scale == min(1.0, allowed / speed)

    def test_points_beyond_the_given_distance_from_the_robot_are_left_out(self):
        ranges = [0.5, 1.6, 20.0, math.inf] * 100
        sweep = dense(ranges)
        assert len(points_of(SPEC, sweep)) == 300
        assert len(points_of(SPEC, sweep, 2.0)) == 200
        aside = msgspec.structs.replace(SPEC, x=1.0)
        assert 0 < len(points_of(aside, sweep, 2.0)) < 200
