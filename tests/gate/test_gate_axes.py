"""Velocities out of the plane: refusals, limits and standstill."""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from equipment.gate_harness import KEY, ZERO, Bench, spec
from webmap.base.errors import ConfigError
from webmap.base.geometry import Twist
from webmap.config.motion import ScanAssistConfig
from webmap.gate import commands, events, protocol
from webmap.gate.events import Scan
from webmap.gate.protocol import PROGRAM
from webmap.gate.specs import Axes, Speed, checked, fit, ramp

FLYING = {"z_max": 0.5, "rx_max": 0.2, "ry_max": 0.1}
EVERYTHING = Twist(0.1, 0.2, 0.3, vz=0.4, wx=0.05, wy=-0.06)
BOX = ((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2))

number = st.floats(-1e308, 1e308)
limit = st.floats(0.0, 10.0)


def begin(*specs, **changes):
    bench = Bench().begin(*specs or (spec(**{**FLYING, "holonomic": True, **changes}),))
    bench.handle(protocol.FromProgram(commands.Take("r1"), 7))
    return bench


def twist(bench, wanted):
    epoch = bench.report().epoch or 0
    command = protocol.FromProgram(
        commands.SetVelocity("r1", epoch, bench.tick, wanted.numbers)
    )
    bench.handle(command)


def measure(bench, seconds, seen, drive=None):
    def each():
        bench.handle(events.OdometryReceived(KEY, seen))
        if drive is not None:
            twist(bench, drive)

    bench.run(seconds, each)


class TestWithoutALimit:
    @pytest.mark.parametrize(
        ("wanted", "name", "unit"),
        [
            (Twist(0.1, vz=0.5), "z", "m/s"),
            (Twist(0.1, wx=0.5), "rx", "rad/s"),
            (Twist(0.1, wy=0.5), "ry", "rad/s"),
        ],
    )
    def test_a_velocity_on_an_axis_without_a_limit_is_refused_as_a_whole(
        self, wanted, name, unit
    ):
        bench = begin(spec())
        twist(bench, wanted)
        bench.run(0.1)
        assert bench.attempts == []
        assert bench.refusals(PROGRAM)[-1].why == (
            f"got {name} = 0.5 {unit}, but no limit of the robot is known for {name}: "
            f"state {name}_max with its twist topic"
        )

    def test_refused_velocities_do_not_prolong_the_previous_velocity(self):
        bench = begin(spec())
        twist(bench, Twist(0.1))
        at = bench.now
        bench.run(0.5, lambda: twist(bench, Twist(0.1, vz=0.5)))
        moving = [w for w in bench.since(at) if not w.twist.is_zero]
        assert moving == []
        assert bench.written[-1].twist == ZERO

    def test_an_alias_without_a_limit_refuses_the_axis_for_the_whole_machine(self):
        bench = begin(spec(**FLYING), spec(id="r2", name="Bob again"))
        twist(bench, Twist(vz=0.1))
        bench.run(0.1)
        assert bench.attempts == []
        assert "no limit of the robot is known for z" in bench.refusals(PROGRAM)[-1].why

    def test_the_limits_of_another_machine_do_not_apply(self):
        bench = begin(spec(), spec(id="r2", twist_topic="/other", **FLYING))
        twist(bench, Twist(vz=0.1))
        assert bench.attempts == []

    def test_fit_zeroes_all_translation_or_rotation_if_one_axis_has_no_limit(self):
        speed = Speed(1.0, 1.0, ())
        assert fit(Twist(0.5, vz=0.1), speed, holonomic=True) == ZERO
        assert fit(Twist(0.5, wx=0.1, wz=0.2), speed, holonomic=True) == Twist(0.5)
        assert fit(Twist(0.5, wy=0.1, wz=0.2), speed, holonomic=True) == Twist(0.5)

    @pytest.mark.parametrize("field", ["z_max", "rx_max", "ry_max"])
    @pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
    def test_a_limit_that_is_not_positive_and_finite_is_refused(self, field, value):
        with pytest.raises(ConfigError, match=f"{field}: got the number {value}"):
            checked(spec(**{field: value}))

    def test_changing_a_limit_ends_the_lease(self):
        bench = begin()
        twist(bench, Twist(vz=0.1))
        bench.handle(spec(holonomic=True))
        assert bench.written[-1].twist == ZERO
        assert bench.report().holder is None


class TestWithLimits:
    def test_all_six_components_of_a_velocity_are_sent_and_reported(self):
        bench = begin()
        twist(bench, EVERYTHING)
        assert bench.written[-1].twist == EVERYTHING
        assert bench.of(protocol.SentTwist)[-1] == protocol.SentTwist(
            "r1", 0.1, 0.2, 0.3, PROGRAM, 0.4, 0.05, -0.06
        )
        bench.run(0.15)
        assert bench.report().sent == EVERYTHING.numbers

    def test_a_velocity_that_is_not_finite_is_refused(self):
        bench = begin()
        twist(bench, Twist(0.1, vz=math.nan))
        assert bench.attempts == []
        assert "finite" in bench.refusals(PROGRAM)[-1].why

    def test_a_velocity_above_the_limits_is_scaled_and_keeps_its_direction(self):
        bench = begin()
        twist(bench, Twist(0.5, vz=-1.0, wx=0.1, wy=0.2))
        assert bench.written[-1].twist == Twist(0.25, vz=-0.5, wx=0.05, wy=0.1)

    def test_the_lowest_limit_of_all_aliases_applies(self):
        bench = begin(spec(**FLYING), spec(id="r2", **{**FLYING, "z_max": 0.2}))
        twist(bench, Twist(vz=0.5))
        assert bench.written[-1].twist == Twist(vz=0.2)

    def test_the_speed_limit_for_missing_settings_also_limits_a_climb(self):
        bench = begin(stops_within=None, z_max=2.0)
        twist(bench, Twist(vz=2.0))
        assert bench.written[-1].twist == Twist(vz=0.3)
        bench = begin(v_max=None, z_max=2.0)
        twist(bench, Twist(vz=2.0))
        assert bench.written[-1].twist == Twist(vz=0.3)

    def test_without_new_commands_zero_is_sent_on_all_axes(self):
        bench = begin()
        twist(bench, EVERYTHING)
        at = bench.now
        bench.run(0.5)
        assert bench.since(at)
        assert {w.twist for w in bench.since(at)} == {ZERO}

    def test_stop_sends_zero_on_all_axes(self):
        bench = begin()
        twist(bench, EVERYTHING)
        at = bench.now
        bench.send("b", op="stop", robot="r1")
        bench.run(1.0)
        assert {w.twist for w in bench.written if w.at > at} == {ZERO}
        assert bench.written[-1].twist == ZERO

    @given(st.builds(Twist, *[number] * 6), st.builds(Axes, *[limit] * 3), limit, limit)
    @example(Twist(vy=2.0, vz=1e-308), Axes(), 1.0, 0.0)
    def test_fit_never_exceeds_a_limit_or_reverses_an_axis(self, wanted, axes, v, w):
        found = fit(wanted, Speed(v, w, ()), holonomic=True, axes=axes)
        assert found.is_finite
        assert found.speed <= v * (1 + 1e-9) + 1e-300
        assert found.turn <= w * (1 + 1e-9) + 1e-300
        assert abs(found.vz) <= axes.z
        assert abs(found.wx) <= axes.rx
        assert abs(found.wy) <= axes.ry
        pairs = zip(found.numbers, wanted.numbers, strict=True)
        assert all(mine * its >= 0 for mine, its in pairs)

    def test_a_climb_is_ramped_like_any_other_motion(self):
        assert ramp(ZERO, Twist(vz=1.0), 2.0, 0.05).vz == pytest.approx(0.1)
        aslant = ramp(ZERO, Twist(1.0, vz=1.0), 2.0, 0.05)
        assert aslant.speed == pytest.approx(0.1)
        assert aslant.vx == pytest.approx(aslant.vz)
        assert ramp(Twist(vz=1.0), Twist(vz=0.2), 2.0, 0.05) == Twist(vz=0.2)
        assert ramp(ZERO, EVERYTHING, 100.0, 0.1) == EVERYTHING

    def test_scan_assist_reduces_the_velocity_on_all_axes(self):
        assist = ScanAssistConfig(
            topic="/scan", footprint=BOX, blind="creep", creep=0.05
        )
        bench = begin(assist=assist)
        twist(bench, Twist(0.1, vz=0.4, wx=0.02))
        assert bench.written[-1].twist == Twist(0.05, vz=0.2, wx=0.01)

    def test_scan_assist_does_not_limit_a_purely_vertical_velocity(self):
        assist = ScanAssistConfig(topic="/scan", footprint=BOX)
        bench = begin(assist=assist)
        ranges = [0.4] * 72
        sweep = Scan(-math.pi, math.tau / 72, 0.05, 8.0, ranges, bench.now)
        bench.handle(events.ScanReceived(KEY, "/scan", sweep))
        twist(bench, Twist(vz=0.4))
        assert bench.written[-1].twist == Twist(vz=0.4)


class TestStandstill:
    CLIMBING = Twist(vz=0.3)
    ROLLING = Twist(wx=0.3)

    @pytest.fixture
    def bench(self):
        return Bench().begin(spec(odometry_topic="/odom", **FLYING))

    @pytest.mark.parametrize(
        ("seen", "words"),
        [
            (Twist(vz=-0.3), "still moving at 0.30 m/s"),
            (Twist(wx=0.3), "still turning at 0.30 rad/s"),
            (Twist(wy=-0.3), "still turning at 0.30 rad/s"),
        ],
    )
    def test_a_stop_is_not_confirmed_while_the_robot_moves_along_any_axis(
        self, bench, seen, words
    ):
        bench.send("b", op="stop", robot="r1")
        measure(bench, 2.2, seen)
        stop = bench.report().stop
        assert (stop.confirmed, stop.why) == (False, words)
        assert bench.report().alarm == f"zero sent, {words}"
        assert bench.report().measured == seen.numbers
        measure(bench, 0.6, ZERO)
        assert bench.report().stop.confirmed is True

    def test_odometry_of_an_axis_without_a_limit_does_not_prevent_standstill(self):
        bench = Bench().begin(spec(odometry_topic="/odom"))
        bench.send("b", op="stop", robot="r1")
        measure(bench, 0.6, Twist(vz=0.3, wx=math.nan, wy=0.4))
        assert bench.report().stop.confirmed is True
        assert bench.report().measured == ZERO.numbers

    def test_odometry_with_nan_on_an_axis_with_a_limit_confirms_no_stop(self, bench):
        bench.send("b", op="stop", robot="r1")
        measure(bench, 2.2, Twist(vz=math.nan))
        stop = bench.report().stop
        assert (stop.confirmed, stop.why) == (False, "no odometry")
        assert bench.report().measured is None

    def test_control_is_handed_over_only_after_the_climb_has_ended(self, bench):
        bench.take("a")
        measure(bench, 0.3, ZERO)
        bench.send("b", op="ask", robot="r1")
        bench.send("a", op="grant", robot="r1")
        measure(bench, 2.0, self.CLIMBING)
        assert bench.report().holder is None
        measure(bench, 0.6, ZERO)
        assert bench.report().holder.connection == "b"

    def test_a_stop_test_does_not_start_while_the_robot_climbs(self, bench):
        bench.take("a")

        def each():
            bench.handle(events.OdometryReceived(KEY, self.CLIMBING))
            bench.drive()

        bench.run(0.5, each)
        bench.send("a", op="stop-test", robot="r1")
        assert bench.refusals("a")[-1].why == "the robot is already moving"

    def test_a_stop_test_fails_if_the_robot_still_climbs_after_3_s(self, bench):
        bench.take("a")
        seen = [ZERO]

        def each():
            bench.handle(events.OdometryReceived(KEY, seen[0]))
            bench.drive()

        bench.run(0.5, each)
        bench.send("a", op="stop-test", robot="r1")
        bench.run(0.2, each)
        seen[0] = Twist(0.1)
        bench.run(0.2, each)
        assert bench.report().test.state == "waiting"
        seen[0] = self.CLIMBING
        bench.run(1.0, each)
        assert bench.report().test.state == "waiting"
        bench.run(2.5, each)
        assert bench.report().test.text == "the base did not stop within 3 s"
