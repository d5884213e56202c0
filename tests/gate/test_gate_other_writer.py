"""Another program that publishes velocities is told from the gate's own echoes."""

from collections import deque
from itertools import count

import numpy as np
import pytest
from gate_harness import KEY, Bench, spec
from hypothesis import given, settings
from hypothesis import strategies as st

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
SAID = "another program publishes to /cmd_vel (0.10 m/s, -0.20 rad/s)"


@pytest.fixture
def writer():
    return OtherWriter()


def hear(writer, twist, times, now=100.0, every=0.1):
    for n in range(times):
        writer.on_echo(twist, now + n * every)


class TestWhatIsAnothers:
    def test_two_velocities_within_a_while_are_and_one_is_not(self, writer):
        hear(writer, THEIRS, SURE - 1)
        assert writer.description("/cmd_vel") is None
        hear(writer, THEIRS, 1, 100.0 + WITHIN)
        assert writer.description("/cmd_vel") == SAID
        other = OtherWriter()
        hear(other, THEIRS, 5, every=WITHIN + 0.1)
        assert other.seen is None

    def test_it_is_gone_when_it_is_not_heard_for_a_while(self, writer):
        hear(writer, THEIRS, 3, every=0.0)
        writer.named(("/teleop",))
        writer.step(100.0 + WITHIN)
        assert writer.description("/cmd_vel") == f"{SAID}: /teleop"
        writer.step(100.1 + WITHIN)
        assert writer.description("/cmd_vel") is None
        writer.named(("/teleop",))
        hear(writer, THEIRS, 3, 200.0)
        assert writer.description("/cmd_vel") == SAID, (
            "who it was then is not known now"
        )

    def test_while_the_gate_writes_too_it_is_found(self, writer):
        for n in range(40):
            now = 100.0 + n * 0.05
            writer.on_written(OURS, now)
            writer.on_echo(OURS, now)
            if n % 2:
                writer.on_echo(THEIRS, now)
        assert writer.seen == THEIRS

    def test_also_of_the_very_value_that_the_gate_writes(self, writer):
        for n in range(200):
            now = 100.0 + n * 0.05
            writer.on_written(OURS, now)
            hear(writer, OURS, ECHOES + 1, now, 0.0)
        assert writer.seen == OURS

    def test_or_wrote_long_ago(self, writer):
        writer.on_written(OURS, 100.0)
        hear(writer, OURS, 2, 100.0 + REMEMBERED + 0.1)
        assert writer.seen == OURS

    def test_what_is_not_sound_in_a_name_is_left_out(self, writer):
        hear(writer, THEIRS, 2)
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
    def test_it_is_said_how_fast(self, writer, twist, words):
        hear(writer, twist, 2)
        assert words in writer.description("/cmd_vel")


class TestWhatIsNot:
    def test_zeros_are_nobodys(self, writer):
        hear(writer, Twist(), 1000, every=0.01)
        hear(writer, Twist(-0.0, 0.0, -0.0), 1000, every=0.01)
        assert writer.seen is None

    @pytest.mark.parametrize("late", [0.0, 0.4, 5.0, 30.0])
    @pytest.mark.parametrize("each", [1, ECHOES])
    @pytest.mark.parametrize("digits", ["float64", "float32", 6])
    def test_an_echo_is_not_late_twice_or_rounded(self, writer, late, each, digits):
        """Driven for ten seconds at speeds that change, with echoes that come late."""

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

    @settings(deadline=None, max_examples=200)
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
    def test_no_order_of_own_echoes_is_another(self, written):
        """However they are held up, and in whatever bursts they come."""
        writer, way, clock = OtherWriter(), deque(), count(100, 0.05)
        for speed, held_up, each in written:
            now = next(clock)
            # As many as a link and its bridge hold.
            if sum(not twist.is_zero for twist in way) < MOST_ECHOES - ECHOES:
                writer.on_written(Twist(speed), now)
                way.extend([Twist(speed)] * each)
            if held_up < 3:
                while way:
                    writer.on_echo(way.popleft(), now)
        assert writer.seen is None

    def test_what_is_expected_is_no_news(self, writer):
        writer.expect(101.0)
        writer.expect(100.5)
        hear(writer, THEIRS, 10)
        assert writer.seen is None
        hear(writer, THEIRS, 2, 101.0)
        assert writer.seen == THEIRS

    def test_what_was_written_long_ago_takes_no_memory(self, writer):
        for n in range(5000):
            writer.on_written(Twist(n / 1000), 100.0 + n * 0.05)
        assert len(writer._own) < 1.1 * REMEMBERED / 0.05


@pytest.fixture
def bench():
    """A robot whose link has been there for a while."""
    bench = Bench().begin()
    bench.run(EXPECTED_FOR)
    return bench


def publish(bench, seconds=0.5, twist=THEIRS, key=KEY):
    """Have another program publish at 10 Hz."""
    turn = count()

    def each():
        if next(turn) % 2:
            bench.tell(events.EchoReceived(key, twist))

    bench.run(seconds, each)


class TestReport:
    def test_it_is_said_before_anybody_drives_and_ends_with_it(self, bench):
        assert bench.report().other_writer is None
        publish(bench)
        assert (bench.report().other_writer, bench.report().holder) == (SAID, None)
        bench.run(WITHIN + 0.2)
        assert bench.report().other_writer is None
        assert not bench.gate.busy

    def test_it_is_said_while_somebody_drives(self, bench):
        bench.drive_off()

        def each():
            bench.drive(x=1.0)
            bench.tell(events.EchoReceived(KEY, bench.written[-1].twist))

        bench.run(1.0, each)
        assert bench.report().other_writer is None

        def both():
            each()
            bench.tell(events.EchoReceived(KEY, THEIRS))

        bench.run(0.5, both)
        report = bench.report()
        assert (report.state, report.other_writer) == ("driving", SAID)

    def test_it_is_said_beside_the_alarm(self):
        bench = Bench().begin(spec(odometry_topic="/odom"))
        bench.run(EXPECTED_FOR)
        seen = events.OdometryReceived(KEY, Twist(0.4))

        def each():
            bench.tell(seen)
            bench.tell(events.EchoReceived(KEY, THEIRS))

        bench.say("a", op="stop", robot="r1")
        bench.run(1.5, each)
        assert bench.report().alarm
        assert bench.report().other_writer == SAID

    def test_its_nodes_are_named_as_the_display_tells_them(self, bench):
        bench.tell(protocol.WriterNodes("r1", ("/teleop",)))
        publish(bench)
        assert bench.report().other_writer == SAID
        bench.tell(protocol.WriterNodes("r1", ("/teleop",)))
        bench.tell(protocol.WriterNodes("r9", ("/other",)))
        assert bench.report().other_writer == f"{SAID}: /teleop"

    def test_speeds_that_change_are_said_ten_times_a_second_at_most(self, bench):
        publish(bench)
        bench.said.clear()
        turn = count()

        def each():
            for _ in range(5):
                bench.tell(events.EchoReceived(KEY, Twist(0.1 + next(turn) / 1000)))

        bench.run(1.0, each)
        assert 5 <= len(bench.of(protocol.RobotReport)) <= 11

    def test_a_new_link_may_bring_what_was_written_before(self, bench):
        bench.break_links()
        bench.connect_links()
        publish(bench, EXPECTED_FOR - 0.1)
        assert bench.report().other_writer is None
        publish(bench, 0.5)
        assert bench.report().other_writer == SAID

    def test_what_another_gate_on_this_computer_drives_is_its_own(self, bench):
        why = "another WebMap on this computer drives it"
        bench.tell(LockState(KEY, held=False, why=why, elsewhere=True))
        publish(bench, 5.0)
        assert bench.report().other_writer is None

    def test_what_follows_a_goal_is_expected_to_drive(self):
        bench = Bench().begin(spec(action="/navigate"))
        bench.run(EXPECTED_FOR)
        bench.take()
        bench.goal()
        publish(bench, 5.0)
        assert bench.report().goal.state == "sent"
        assert bench.report().other_writer is None
        goal = bench.report().goal
        bench.tell(events.GoalEnded("r1", goal.id))
        publish(bench, EXPECTED_FOR - 0.2)
        assert bench.report().other_writer is None
        publish(bench, 1.0)
        assert bench.report().other_writer == SAID

    def test_but_not_after_a_goal_whose_end_nobody_tells(self):
        bench = Bench().begin(spec(cancel_topic=None))
        bench.run(EXPECTED_FOR)
        bench.take()
        bench.goal()
        publish(bench, 5.0)
        assert bench.report().other_writer == SAID

    def test_a_machine_that_is_gone_is_no_matter(self, bench):
        publish(bench, key=Key("ws://gone:9090", "/cmd_vel"))
        assert bench.report().other_writer is None
