"""Velocities of another program are distinguished from the gate's own echoes."""

from collections import deque
from itertools import count

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equipment.gate_harness import KEY, Bench, spec
from webmap.base.geometry import Twist
from webmap.gate import events, protocol
from webmap.gate.events import Key, LockState
from webmap.gate.rules.obedience import (
    ECHOES,
    EXPECTED_FOR,
    MOST_ECHOES,
    REMEMBERED,
    SURE,
    WITHIN,
    OtherWriter,
)

OURS, THEIRS = Twist(0.5, 0.0, 0.25), Twist(0.1, 0.0, -0.2)
REPORTED = "another program publishes to /cmd_vel (0.10 m/s, -0.20 rad/s)"


@pytest.fixture
def writer():
    return OtherWriter()


def receive(writer, twist, times, now=100.0, every=0.1):
    for n in range(times):
        writer.on_echo(twist, now + n * every)


class TestOtherProgram:
    def test_two_foreign_velocities_within_3_s_report_another_program(self, writer):
        receive(writer, THEIRS, SURE - 1)
        assert writer.description("/cmd_vel") is None
        receive(writer, THEIRS, 1, 100.0 + WITHIN)
        assert writer.description("/cmd_vel") == REPORTED
        other = OtherWriter()
        receive(other, THEIRS, 5, every=WITHIN + 0.1)
        assert other.seen is None

    def test_another_program_is_dropped_after_3_s_without_its_velocities(self, writer):
        receive(writer, THEIRS, 3, every=0.0)
        writer.named(("/teleop",))
        writer.step(100.0 + WITHIN)
        assert writer.description("/cmd_vel") == f"{REPORTED}: /teleop"
        writer.step(100.1 + WITHIN)
        assert writer.description("/cmd_vel") is None
        writer.named(("/teleop",))
        receive(writer, THEIRS, 3, 200.0)
        assert writer.description("/cmd_vel") == REPORTED, (
            "the earlier node names do not apply"
        )

    def test_another_program_is_found_while_the_gate_writes_too(self, writer):
        for n in range(40):
            now = 100.0 + n * 0.05
            writer.on_written(OURS, now)
            writer.on_echo(OURS, now)
            if n % 2:
                writer.on_echo(THEIRS, now)
        assert writer.seen == THEIRS

    def test_another_program_with_the_same_velocity_as_the_gate_is_found(self, writer):
        for n in range(200):
            now = 100.0 + n * 0.05
            writer.on_written(OURS, now)
            receive(writer, OURS, ECHOES + 1, now, 0.0)
        assert writer.seen == OURS

    def test_a_velocity_that_the_gate_wrote_long_ago_counts_as_foreign(self, writer):
        writer.on_written(OURS, 100.0)
        receive(writer, OURS, 2, 100.0 + REMEMBERED + 0.1)
        assert writer.seen == OURS

    def test_invalid_node_names_are_dropped_and_long_names_are_shortened(self, writer):
        receive(writer, THEIRS, 2)
        writer.named(("/a\x1b[31m", " ", "/b" * 100, "/c", "/d", "/e"))
        assert writer.nodes == (("/b" * 100)[:80], "/c", "/d")
        writer.named(())
        assert writer.description("/v").endswith("): another client of the bridge")

    @pytest.mark.parametrize(
        ("twist", "words"),
        [
            (Twist(-0.3, 0.0, -0.001), "(-0.30 m/s, 0.00 rad/s)"),
            (Twist(0.3, -0.4), "(0.50 m/s, 0.00 rad/s)"),
            (Twist(0.0, 0.4, 1.0), "(0.40 m/s, 1.00 rad/s)"),
        ],
    )
    def test_the_description_gives_the_speed_and_turn_rate(self, writer, twist, words):
        receive(writer, twist, 2)
        assert words in writer.description("/cmd_vel")


class TestOwnEcho:
    def test_zeros_do_not_report_another_program(self, writer):
        receive(writer, Twist(), 1000, every=0.01)
        receive(writer, Twist(-0.0, 0.0, -0.0), 1000, every=0.01)
        assert writer.seen is None

    @pytest.mark.parametrize("late", [0.0, 0.4, 5.0, 30.0])
    @pytest.mark.parametrize("each", [1, ECHOES])
    @pytest.mark.parametrize("digits", ["float64", "float32", 6])
    def test_late_doubled_and_rounded_echoes_do_not_report_another_program(
        self, writer, late, each, digits
    ):
        """The robot is driven for ten seconds at changing speeds, with late echoes."""

        def echo(part):
            if isinstance(digits, int):
                return float(f"{part:.{digits}g}")
            return float(np.dtype(digits).type(part))

        way = deque()
        rng = np.random.default_rng(7)
        for n in range(400):
            now = 100.0 + n * 0.05
            if n < 200:
                parts = rng.normal(size=3).round(rng.integers(1, 8)).tolist()
                writer.on_written(Twist(*parts), now)
                way.extend([(now + late, Twist(*map(echo, parts)))] * each)
            while way and way[0][0] <= now:
                writer.on_echo(way.popleft()[1], now)
            writer.step(now)
            assert writer.seen is None
        for _, twist in way:  # a burst, after a stall
            writer.on_echo(twist, now + 15.0)
        assert writer.seen is None

    @settings(deadline=None, max_examples=50)
    @given(
        st.lists(
            st.tuples(
                st.sampled_from([0.0, 0.1, 0.1235, 0.5, -0.5]),
                st.integers(0, 10),
                st.integers(1, ECHOES),
            ),
            max_size=60,
        )
    )
    def test_own_echoes_in_any_rhythm_do_not_report_another_program(self, written):
        """Echoes may be delayed, and may arrive in bursts."""
        writer, way, clock = OtherWriter(), deque(), count(100, 0.05)
        for speed, held_up, each in written:
            now = next(clock)
            # The most echoes that a link and its bridge hold.
            if sum(not twist.is_zero for twist in way) < MOST_ECHOES - ECHOES:
                writer.on_written(Twist(speed), now)
                way.extend([Twist(speed)] * each)
            if held_up < 3:
                while way:
                    writer.on_echo(way.popleft(), now)
        assert writer.seen is None

    def test_expected_foreign_velocities_do_not_report_another_program(self, writer):
        writer.expect(101.0)
        writer.expect(100.5)
        receive(writer, THEIRS, 10)
        assert writer.seen is None
        receive(writer, THEIRS, 2, 101.0)
        assert writer.seen == THEIRS

    def test_velocities_written_long_ago_are_removed_from_memory(self, writer):
        for n in range(5000):
            writer.on_written(Twist(n / 1000), 100.0 + n * 0.05)
        assert len(writer._own) < 1.1 * REMEMBERED / 0.05


@pytest.fixture
def bench():
    """A robot whose link has been open for some seconds."""
    bench = Bench().begin()
    bench.run(EXPECTED_FOR)
    return bench


def publish(bench, seconds=0.5, twist=THEIRS, key=KEY):
    """Let another program publish at 10 Hz."""
    turn = count()

    def each():
        if next(turn) % 2:
            bench.handle(events.EchoReceived(key, twist))

    bench.run(seconds, each)


class TestReport:
    def test_another_program_is_reported_for_a_free_robot_until_the_program_ends(
        self, bench
    ):
        assert bench.report().other_writer is None
        publish(bench)
        assert (bench.report().other_writer, bench.report().holder) == (REPORTED, None)
        bench.run(WITHIN + 0.2)
        assert bench.report().other_writer is None
        assert not bench.gate.busy

    def test_another_program_is_reported_while_an_operator_drives(self, bench):
        bench.drive_off()

        def each():
            bench.drive(x=1.0)
            bench.handle(events.EchoReceived(KEY, bench.written[-1].twist))

        bench.run(1.0, each)
        assert bench.report().other_writer is None

        def both():
            each()
            bench.handle(events.EchoReceived(KEY, THEIRS))

        bench.run(0.5, both)
        report = bench.report()
        assert (report.state, report.other_writer) == ("driving", REPORTED)

    def test_another_program_and_the_motion_alarm_are_reported_together(self):
        bench = Bench().begin(spec(odometry_topic="/odom"))
        bench.run(EXPECTED_FOR)
        seen = events.OdometryReceived(KEY, Twist(0.4))

        def each():
            bench.handle(seen)
            bench.handle(events.EchoReceived(KEY, THEIRS))

        bench.send("a", op="stop", robot="r1")
        bench.run(1.5, each)
        assert bench.report().alarm
        assert bench.report().other_writer == REPORTED

    def test_the_report_names_the_nodes_that_the_display_found(self, bench):
        bench.handle(protocol.WriterNodes("r1", ("/teleop",)))
        publish(bench)
        assert bench.report().other_writer == REPORTED
        bench.handle(protocol.WriterNodes("r1", ("/teleop",)))
        bench.handle(protocol.WriterNodes("r9", ("/other",)))
        assert bench.report().other_writer == f"{REPORTED}: /teleop"

    def test_changing_foreign_speeds_are_reported_at_most_about_10_times_a_second(
        self, bench
    ):
        publish(bench)
        bench.messages.clear()
        turn = count()

        def each():
            for _ in range(5):
                bench.handle(events.EchoReceived(KEY, Twist(0.1 + next(turn) / 1000)))

        bench.run(1.0, each)
        assert 5 <= len(bench.of(protocol.RobotReport)) <= 11

    def test_foreign_velocities_are_ignored_for_2_s_after_a_new_link(self, bench):
        bench.break_links()
        bench.connect_links()
        publish(bench, EXPECTED_FOR - 0.1)
        assert bench.report().other_writer is None
        publish(bench, 0.5)
        assert bench.report().other_writer == REPORTED

    def test_velocities_of_another_gate_on_this_computer_are_not_reported(self, bench):
        why = "another WebMap on this computer uses this robot"
        bench.handle(LockState(KEY, held=False, why=why, elsewhere=True))
        publish(bench, 5.0)
        assert bench.report().other_writer is None

    def test_velocities_during_a_goal_and_shortly_after_are_not_reported(self):
        bench = Bench().begin(spec(action="/navigate"))
        bench.run(EXPECTED_FOR)
        bench.take()
        bench.goal()
        publish(bench, 5.0)
        assert bench.report().goal.state == "sent"
        assert bench.report().other_writer is None
        goal = bench.report().goal
        bench.handle(events.GoalEnded("r1", goal.id))
        publish(bench, EXPECTED_FOR - 0.2)
        assert bench.report().other_writer is None
        publish(bench, 1.0)
        assert bench.report().other_writer == REPORTED

    def test_velocities_after_a_goal_whose_end_is_unknown_are_reported(self):
        bench = Bench().begin(spec(cancel_topic=None))
        bench.run(EXPECTED_FOR)
        bench.take()
        bench.goal()
        publish(bench, 5.0)
        assert bench.report().other_writer == REPORTED

    def test_an_echo_of_an_unknown_machine_is_ignored(self, bench):
        publish(bench, key=Key("ws://gone:9090", "/cmd_vel"))
        assert bench.report().other_writer is None
