"""The gate's decisions on a virtual clock, one situation in each test."""

import json

import msgspec
import pytest

from equipment.gate_harness import KEY, URL, ZERO, Bench, spec
from webmap.base.geometry import Twist
from webmap.gate import actions, commands, events, protocol
from webmap.gate.events import Key
from webmap.gate.protocol import PROGRAM
from webmap.gate.rules.motion import DEADMAN


@pytest.fixture
def bench():
    return Bench().begin()


class TestTakeControl:
    def test_taking_a_free_robot_gives_control_and_an_epoch(self, bench):
        assert bench.report().state == "free"
        epoch = bench.take("a")
        report = bench.report()
        assert epoch is not None
        assert report.state == "held"
        assert report.holder == protocol.Holder("a", "A")
        assert not report.armed

    def test_taking_control_twice_keeps_the_epoch(self, bench):
        assert bench.take("a") == bench.take("a")

    def test_a_second_operator_cannot_take_control(self, bench):
        bench.take("a")
        assert bench.take("b") is None
        assert bench.refusals("b")[-1].why == "A has control"

    def test_a_viewer_cannot_take_control(self, bench):
        bench.join("v", "viewer")
        assert bench.take("v") is None
        assert "viewers" in bench.refusals("v")[-1].why

    def test_after_release_another_operator_takes_control_with_a_higher_epoch(
        self, bench
    ):
        first = bench.take("a")
        bench.send("b", op="release", robot="r1")  # b has no control to release
        assert bench.state == "held"
        bench.send("a", op="release", robot="r1")
        assert bench.state == "free"
        assert bench.take("b") > first

    def test_taking_an_unknown_robot_is_refused_with_its_id(self, bench):
        bench.send("a", op="take", robot="r9")
        assert "'r9'" in bench.refusals()[-1].why

    @pytest.mark.parametrize(
        ("bench", "why"),
        [
            (Bench(lock_held=False), "another has it"),
            (Bench(beating=False), "the display process does not respond"),
        ],
    )
    def test_a_robot_that_cannot_be_driven_reports_the_reason(self, bench, why):
        bench.begin()
        report = bench.report()
        assert not report.armable
        assert report.reason == why
        assert bench.take() is None
        assert bench.refusals()[-1].why == why

    def test_control_cannot_be_taken_without_a_link(self, bench):
        bench.break_links()
        assert bench.report().link == "down"
        assert bench.take() is None
        assert URL in bench.refusals()[-1].why

    def test_the_lease_ends_when_its_connection_closes(self, bench):
        bench.take("a")
        bench.handle(protocol.Disconnect("a"))
        assert bench.state == "free"
        assert bench.take("b")

    def test_a_connection_that_reopens_does_not_keep_the_lease(self, bench):
        bench.take("a")
        bench.join("a")
        assert bench.state == "free"


class TestDriving:
    def test_nothing_moves_until_all_inputs_were_released(self, bench):
        bench.take()
        bench.hold(0.5, x=1.0)
        assert bench.written == []
        assert bench.refusals()[-1].why == "release all inputs first"

    def test_neutral_inputs_send_no_velocity(self, bench):
        bench.take()
        bench.hold(2.0)
        assert bench.written == []
        assert bench.report().armed

    def test_an_input_drives_at_its_share_of_the_speed_limit(self, bench):
        bench.drive_off(x=0.5)
        assert bench.state == "driving"
        assert {w.twist for w in bench.written} == {Twist(0.5, 0.0, 0.0)}
        bench.hold(0.2, x=-1.0, turn=0.5)
        assert bench.written[-1].twist == Twist(-1.0, 0.0, 0.75)

    def test_released_inputs_send_zeros_at_once_for_500_ms_and_then_nothing(
        self, bench
    ):
        bench.drive_off()
        bench.drive(x=0)
        at = bench.now
        assert bench.written[-1].twist == ZERO
        assert bench.state == "stopping"
        bench.hold(2.0)
        zeros = [w for w in bench.written if w.at >= at]
        assert {w.twist for w in zeros} == {ZERO}
        assert 9 <= len(zeros) <= 11
        assert zeros[-1].at < at + 0.5
        assert bench.state == "held"

    def test_after_released_inputs_a_new_input_drives_at_once(self, bench):
        bench.drive_off()
        bench.drive(x=0)
        bench.run(0.05)
        bench.drive(x=1.0)
        assert bench.written[-1].twist == Twist(1.0)

    def test_zero_is_sent_when_the_dead_man_timeout_ends(self, bench):
        bench.drive_off()
        last = bench.now
        bench.drive(x=1.0)
        bench.run(0.5)
        first = next(w for w in bench.since(last) if w.twist == ZERO)
        assert DEADMAN <= first.at - last <= DEADMAN + 0.0101

    def test_after_the_dead_man_timeout_a_held_key_moves_nothing_until_released(
        self, bench
    ):
        bench.drive_off()
        bench.run(0.5)
        at = bench.now
        bench.hold(2.0, x=1.0)
        assert bench.moving_since(at) == []
        bench.hold(0.3)
        bench.hold(0.1, x=1.0)
        assert bench.moving_since(at) != []

    def test_a_silent_page_must_send_neutral_inputs_again_before_driving(self, bench):
        bench.take()
        bench.hold(0.3)
        bench.run(DEADMAN + 0.1)
        assert not bench.report().armed
        bench.hold(0.3, x=1.0)
        assert bench.written == []

    def test_the_gate_does_not_repeat_a_command(self, bench):
        bench.take()
        bench.hold(0.3)
        bench.drive(x=1.0)
        bench.run(0.15)
        assert len(bench.written) == 1

    def test_many_commands_at_once_are_reduced_to_the_newest(self, bench):
        bench.drive_off()
        at = bench.now
        bench.run(0.05)
        for x in (0.1, 0.2, 0.3, 0.4):
            bench.drive(x=x)
        bench.run(0.05)
        written = bench.since(at)
        assert len(written) == 2
        assert written[-1].twist.vx == 0.4

    def test_an_input_beyond_full_scale_drives_at_the_speed_limit(self, bench):
        bench.drive_off(x=100)
        bench.drive(x=100)
        assert bench.written[-1].twist == Twist(1.0)

    def test_a_base_that_is_not_holonomic_gets_no_sideways_velocity(self, bench):
        bench.drive_off()
        bench.drive(y=1.0, x=0.0, turn=0.0)
        bench.run(0.05)
        assert bench.written[-1].twist.vy == 0

    def test_a_holonomic_base_drives_sideways_within_the_speed_limit(self):
        bench = Bench().begin(spec(holonomic=True))
        bench.drive_off()
        bench.run(0.05)
        bench.drive(x=1.0, y=1.0)
        twist = bench.written[-1].twist
        assert twist.vx == pytest.approx(2**-0.5)
        assert twist.vy == pytest.approx(2**-0.5)

    def test_the_speed_limit_of_the_page_also_applies_while_driving(self, bench):
        bench.handle(protocol.Speeds("a", 0.5, 9.0))
        bench.drive_off()
        assert bench.written[-1].twist.vx == 0.5
        assert bench.report().why == ("limit of the robot", "normal limit")
        bench.handle(protocol.Speeds("a", 0.2, 9.0))
        bench.hold(0.1, x=1.0)
        assert bench.written[-1].twist.vx == 0.2
        bench.handle(protocol.Speeds("nobody", 0.1, 0.1))
        bench.handle(protocol.Speeds("b", 0.1, 0.1))
        assert bench.report().v == 0.2

    def test_a_lower_speed_limit_also_applies_to_a_waiting_command(self, bench):
        bench.drive_off()
        bench.run(0.05)
        bench.drive(x=0.9)
        bench.drive(x=1.0)  # too soon: the command waits
        bench.handle(protocol.Speeds("a", 0.3, 0.3))
        bench.run(0.05)
        assert bench.written[-1].twist.vx == 0.3

    def test_acceleration_is_ramped_and_stopping_is_not(self):
        bench = Bench().begin(spec(a_max=0.5))
        bench.drive_off()
        speeds = [w.twist.vx for w in bench.written]
        assert speeds[0] <= 0.05 + 1e-9
        assert speeds == sorted(speeds)
        assert speeds[-1] < 0.25
        bench.drive(x=0.0)
        assert bench.written[-1].twist == ZERO


class TestFreshness:
    @pytest.fixture
    def driving(self, bench):
        bench.drive_off()
        bench.run(0.05)
        self.at = bench.now
        return bench

    def refused(self, bench, why):
        assert bench.since(self.at) == []
        assert why in bench.refusals()[-1].why

    @pytest.mark.parametrize("x", [0.5, 0.0])
    @pytest.mark.parametrize(
        ("tick", "why"), [(-7, "over 300 ms"), (-4000, "gate restart")]
    )
    def test_a_command_with_an_old_tick_is_refused_and_zero_is_sent_at_once(
        self, driving, x, tick, why
    ):
        driving.drive(x=x, tick=driving.tick + tick)
        assert [w.twist for w in driving.since(self.at - 0.001)] == [ZERO]
        assert why in driving.refusals()[-1].why
        assert driving.report().holder.connection == "a"

    def test_after_an_old_tick_inputs_must_be_released_before_driving(self, driving):
        driving.drive(x=0.5, tick=driving.tick - 7)
        driving.hold(1.0, x=1.0)
        assert driving.moving_since(self.at) == []
        driving.hold(0.3)
        driving.hold(0.1, x=1.0)
        assert driving.moving_since(self.at)

    def test_a_gate_that_was_paused_sends_zero_before_anything_else(self, driving):
        driving.held_up = 1.5  # between the decision and the write
        driving.drive(x=1.0)
        driving.held_up = 0.0
        driving.hold(1.0, x=1.0)
        assert driving.dropped[-1].twist.vx > 0
        assert driving.since(self.at)[0].twist == ZERO
        assert driving.moving_since(self.at) == []

    @pytest.mark.parametrize("stale", [{}, {"tick": 1}])
    def test_a_command_without_the_current_lease_does_not_stop_a_driven_robot(
        self, driving, stale
    ):
        old = driving.report().epoch - 1
        driving.drive("b", x=0.5, **stale)
        driving.drive("a", x=0.5, epoch=old, **stale)
        driving.handle(
            protocol.FromProgram(
                commands.SetVelocity("r1", old + 1, 1, (0.0, 0.0, 0.0))
            )
        )
        assert driving.since(self.at) == []
        assert driving.state == "driving"

    def test_a_goal_with_an_old_tick_stops_the_robot_and_is_not_sent(self, driving):
        driving.goal(tick=driving.tick - 7)
        assert driving.written[-1].twist == ZERO
        assert driving.did(actions.SendGoal) == []

    def test_a_page_that_sends_commands_but_receives_no_ticks_is_stopped(self, driving):
        seen = driving.tick
        driving.run(0.5, lambda: driving.drive(x=1.0, tick=seen))
        zero = next(w for w in driving.since(self.at) if w.twist == ZERO)
        # The timeout counts from the last command with a new tick: the first command.
        assert zero.at - self.at <= DEADMAN + 2 * 0.01 + 1e-9
        assert driving.moving_since(zero.at) == []

    def test_a_command_whose_seq_does_not_increase_is_refused(self, driving):
        driving.drive(x=0.5, seq=driving.seq)
        self.refused(driving, "seq")

    def test_a_command_with_another_epoch_is_refused(self, driving):
        driving.drive(x=0.5, epoch=driving.report().epoch - 1)
        self.refused(driving, "epoch")

    def test_a_command_of_another_connection_is_refused(self, driving):
        driving.drive("b", x=0.5)
        assert driving.since(self.at) == []
        assert driving.refusals("b")[-1].why == "A has control"

    def test_a_command_without_a_lease_is_refused(self, bench):
        bench.drive(x=0.5)
        assert "take control first" in bench.refusals()[-1].why

    def test_a_refused_command_does_not_restart_the_dead_man_timeout(self, bench):
        bench.drive_off()
        last = bench.now
        bench.run(0.4, lambda: bench.drive(x=1.0, tick=1))
        first = next(w for w in bench.since(last) if w.twist == ZERO)
        assert first.at - last <= 0.21

    def test_a_backlog_of_commands_after_a_stall_moves_nothing(self, bench):
        bench.drive_off()
        stale = []
        bench.run(3.0, lambda: stale.append(bench.tick))
        at = bench.now
        for tick in stale:
            bench.drive(x=1.0, tick=tick)
        bench.run(0.3)
        assert bench.moving_since(at) == []

    def test_a_tick_acknowledges_the_newest_accepted_seq(self, bench):
        bench.take()
        bench.hold(0.3)
        bench.drive(tick=1)  # refused
        bench.run(0.06)
        tick = bench.of(protocol.Tick)[-1]
        assert tick.acks["a"] == bench.seq - 1
        assert tick.acks["b"] == -1


class TestMalformed:
    def test_invalid_commands_do_not_restart_the_dead_man_timeout(self, bench):
        bench.drive_off()
        last = bench.now

        def mixed():
            for _ in range(9):
                bench.handle(protocol.FromPage("a", b'{"op":"drive","x":NaN}'))

        bench.run(2 * DEADMAN, mixed)
        first = next(w for w in bench.since(last) if w.twist == ZERO)
        assert first.at - last <= DEADMAN + 0.01

    def test_many_invalid_commands_close_the_connection_once(self, bench):
        for _ in range(50):
            bench.handle(protocol.FromPage("a", b"rubbish"))
        (close,) = bench.of(protocol.CloseConnection)
        assert close.connection == "a"
        refused = [r for r in bench.refusals() if r.what == "command"]
        assert len(refused) == 1

    def test_a_few_invalid_commands_do_not_close_the_connection(self, bench):
        bench.run(3.0, lambda: bench.send("a", op="nonsense"), step=0.06)
        assert bench.of(protocol.CloseConnection) == []

    def test_a_flood_of_valid_commands_also_closes_the_connection(self, bench):
        for _ in range(500):
            bench.send("a", op="take", robot="r9")
        assert len(bench.of(protocol.CloseConnection)) == 1

    def test_commands_of_unknown_connections_are_ignored(self, bench):
        bench.send("nobody", op="take", robot="r1")
        bench.send(PROGRAM, op="take", robot="r1")
        assert bench.state == "free"
        bench.handle(protocol.Connect(PROGRAM, "x", "viewer"))
        bench.handle(protocol.Disconnect(PROGRAM))
        bench.handle(protocol.Disconnect("nobody"))
        bench.handle(protocol.FromProgram(commands.Take("r1"), 1))
        assert bench.state == "held"


class TestStop:
    @pytest.mark.parametrize("robot", ["r1", "*"])
    @pytest.mark.parametrize("who", ["a", "b", "v"])
    def test_stop_by_any_page_stops_a_driven_robot_at_once(self, bench, who, robot):
        bench.join("v", "viewer")
        epoch = bench.drive_off()
        before = len(bench.written)
        bench.send(who, op="stop", robot=robot)
        assert bench.written[before].twist == ZERO
        assert len(bench.written) == before + 1
        report = bench.report()
        assert report.state == "stopped"
        assert report.holder is None
        assert bench.did(actions.CancelGoals)
        at = bench.now
        bench.run(1.0, lambda: bench.drive(x=1.0, epoch=epoch))
        assert bench.moving_since(at) == []
        assert bench.state == "stopped"

    def test_stop_also_sends_zeros_to_a_robot_without_an_operator(self, bench):
        bench.send("b", op="stop", robot="r1")
        assert bench.written[0].twist == ZERO
        bench.run(1.0)
        assert len(bench.written) in (15, 16, 17)
        assert bench.state == "stopped"

    def test_a_repeated_stop_sends_zero_again(self, bench):
        bench.drive_off()
        for _ in range(5):
            bench.run(0.02)
            before = len(bench.written)
            bench.send("b", op="stop", robot="*")
            bench.send("b", op="stop", robot="*")
            assert len(bench.written) == before + 1

    def test_the_operator_receives_the_name_of_the_person_who_pressed_stop(self, bench):
        bench.take("a")
        bench.send("b", op="stop", robot="r1")
        refused = bench.refusals("a")[-1]
        assert (refused.what, refused.why) == ("lease", "STOP by B")

    def test_stop_of_an_unknown_robot_is_refused(self, bench):
        bench.send("b", op="stop", robot="r9")
        assert bench.refusals("b")[-1].what == "stop"

    def test_a_program_can_stop_and_reset_a_robot(self, bench):
        bench.drive_off()
        bench.handle(protocol.FromProgram(commands.Stop(None)))
        assert bench.written[-1].twist == ZERO
        bench.handle(protocol.FromProgram(commands.Reset("r1", bench.stop_of())))
        bench.drive_off()
        assert bench.written[-1].twist != ZERO
        bench.handle(protocol.FromProgram(commands.Stop("r1")))
        assert bench.written[-1].twist == ZERO
        bench.handle(protocol.FromProgram(commands.Stop("r9")))
        bench.handle(protocol.FromProgram(commands.Reset("r1", bench.stop_of())))
        assert bench.state == "stopping"

    def test_a_stop_without_a_link_is_sent_first_on_the_next_link(self, bench):
        bench.break_links()
        bench.send("b", op="stop", robot="r1")
        assert bench.written == []
        bench.run(3.0)
        bench.connect_links()
        assert bench.written[0].twist == ZERO
        assert len(bench.did(actions.CancelGoals)) == 1


class TestHandOver:
    def test_a_zero_separates_the_velocities_of_two_operators(self, bench):
        first = bench.drive_off("a")
        bench.send("a", op="release", robot="r1")
        second = bench.drive_off("b", x=0.5)
        epochs = [w.epoch for w in bench.written if not w.twist.is_zero]
        assert set(epochs) == {first, second}
        assert epochs == sorted(epochs)
        last = max(n for n, w in enumerate(bench.written) if w.epoch == first)
        assert bench.written[last].twist == ZERO

    def test_an_unsent_zero_is_sent_before_the_velocities_of_the_next_operator(
        self, bench
    ):
        bench.drive_off("a")
        # The socket accepts no data, but its loss is not noticed yet.
        bench.up = False
        bench.send("a", op="release", robot="r1")
        bench.take("b")
        bench.run(0.2)
        bench.up = True
        before = len(bench.written)
        bench.hold(1.0, "b")
        bench.hold(0.3, "b", x=1.0)
        assert bench.written[before].twist == ZERO
        assert bench.written[-1].twist == Twist(1.0)

    def test_a_new_epoch_starts_with_zero_even_if_earlier_zeros_were_lost(self, bench):
        bench.drive_off("a")
        bench.losing_zeros = True
        bench.send("a", op="release", robot="r1")
        bench.take("b")
        bench.hold(1.0, "b")
        before = len(bench.written)
        bench.losing_zeros = False
        bench.hold(0.2, "b", x=1.0)
        assert bench.written[before].twist == ZERO
        assert bench.written[-1].twist == Twist(1.0)


class TestLinks:
    def test_a_lost_link_blocks_inputs_and_the_next_link_starts_with_zero(self, bench):
        bench.drive_off()
        bench.break_links()
        bench.hold(1.0, x=1.0)
        before = len(bench.written)
        bench.connect_links()
        assert bench.written[before].twist == ZERO
        at = bench.now
        bench.hold(1.0, x=1.0)
        assert bench.moving_since(at) == []
        bench.hold(0.3)
        bench.hold(0.1, x=1.0)
        assert bench.moving_since(at) != []

    def test_released_inputs_do_not_count_without_a_link(self, bench):
        bench.take()
        bench.break_links()
        bench.hold(1.0)
        bench.connect_links()
        bench.hold(1.0, x=1.0)
        assert bench.moving_since(0) == []

    def test_a_robot_that_was_not_driven_receives_nothing_on_a_new_link(self, bench):
        bench.take()
        bench.hold(0.5)
        bench.break_links()
        bench.run(1.0)
        bench.connect_links()
        bench.run(1.0)
        assert bench.written == []

    def test_a_link_without_ping_answers_stops_the_robot_and_is_cut(self, bench):
        bench.drive_off()
        bench.answering = False
        at = bench.now
        bench.hold(2.0, x=1.0)
        moving = bench.moving_since(at)
        assert len(moving) <= 7
        assert max(w.at for w in moving) <= at + 0.31
        assert bench.since(at)[len(moving)].twist == ZERO
        assert bench.did(actions.CutLink) == [actions.CutLink(URL)]
        assert "no connection" in bench.refusals()[-1].why

    def test_after_a_link_answers_again_a_held_key_moves_nothing(self, bench):
        bench.drive_off()
        bench.answering = False
        bench.hold(0.6, x=1.0)
        assert bench.report().reason == f"no answer from {URL}"
        bench.answering = True
        at = bench.now
        bench.hold(1.0, x=1.0)
        assert bench.moving_since(at) == []

    def test_an_unconfirmed_zero_is_sent_again_although_older_pings_are_answered(
        self, bench
    ):
        bench.drive_off()
        bench.answering = False
        bench.send("a", op="release", robot="r1")
        released = bench.now
        assert bench.written[-1].twist == ZERO
        bench.now += 0.003
        bench.handle(events.PingAnswered(URL, released - 0.03))
        bench.run(1.5)
        assert bench.did(actions.CutLink) == [actions.CutLink(URL)]
        assert bench.did(actions.MarkDriven) == [actions.MarkDriven(KEY, True)]
        before = len(bench.written)
        bench.connect_links()
        assert bench.written[before].twist == ZERO
        bench.answering = True
        bench.run(4.0)
        assert bench.did(actions.MarkDriven)[-1] == actions.MarkDriven(KEY, False)

    def test_a_stop_is_confirmed_only_after_a_later_ping_is_answered(self):
        bench = Bench().begin(spec(odometry_topic="/odom"))
        not_moving = lambda: bench.handle(events.OdometryReceived(KEY, ZERO))  # noqa: E731
        bench.answering = False
        bench.send("b", op="stop", robot="r1")
        pressed = bench.now
        bench.run(0.1)
        bench.handle(events.PingAnswered(URL, pressed - 0.01))
        bench.run(0.5, not_moving)
        assert bench.report().stop.confirmed is None
        bench.handle(events.PingAnswered(URL, pressed + 0.01))
        bench.run(0.1, not_moving)
        assert bench.report().stop.confirmed

    def test_a_command_that_cannot_be_sent_at_once_is_dropped_and_reported(self, bench):
        bench.drive_off()
        bench.clear = False
        at = bench.now
        bench.hold(0.5, x=1.0)
        assert bench.moving_since(at) == []
        assert bench.dropped
        assert "too slow" in bench.refusals()[-1].why
        bench.clear = True
        bench.hold(0.1, x=1.0)
        assert len(bench.moving_since(at)) <= 2

    def test_events_of_unknown_machines_write_nothing(self, bench):
        gone = Key(URL, "/gone")
        bench.handle(events.TwistWritten(gone, ZERO, 1, "a", True))
        bench.handle(events.EchoReceived(gone, ZERO))
        bench.handle(events.OdometryReceived(gone, ZERO))
        bench.handle(events.LockState(gone, held=True))
        bench.handle(events.GoalWritten("r9", "g", 0, 0, 0, "a", True))
        bench.handle(events.GoalEnded("r9", "g"))
        bench.handle(events.LinkUp("ws://other", "odometry"))
        bench.handle(events.LinkDown("ws://other", "odometry"))
        assert bench.written == []


class TestDisplay:
    def test_a_silent_display_stops_a_driven_robot_within_270_ms(self, bench):
        bench.drive_off()
        bench.beating = False
        at = bench.now
        bench.hold(0.5, x=1.0)
        first = next(w for w in bench.since(at) if w.twist == ZERO)
        assert first.at - at <= 0.2701
        at = bench.now
        bench.beating = True
        bench.hold(0.5, x=1.0)
        assert bench.moving_since(at) == []
        assert bench.report().reason is None

    def test_a_shutdown_stops_a_driven_robot_and_prevents_taking_control(self, bench):
        bench.drive_off()
        bench.handle(events.Shutdown("the end"))
        assert bench.written[-1].twist == ZERO
        assert not bench.gate.silent
        assert bench.refusals("a")[-1].why == "the end"
        assert bench.take("b") is None
        bench.run(0.52)
        assert bench.gate.silent

    def test_ticks_come_at_20_hz(self, bench):
        before = len(bench.of(protocol.Tick))
        bench.run(1.0)
        ticks = [t.tick for t in bench.of(protocol.Tick)][before:]
        assert len(ticks) in (19, 20, 21)
        assert ticks == list(range(ticks[0], ticks[0] + len(ticks)))


class TestOdometryLost:
    @pytest.fixture
    def bench(self):
        return Bench().begin(spec(odometry_topic="/odom"))

    def moves(self, bench, *, seen):
        def each():
            if seen:
                bench.handle(events.OdometryReceived(KEY, Twist(0.1)))
            bench.drive(x=x)

        at = bench.now
        for x, seconds in ((0.0, 0.4), (1.0, 0.5)):  # noqa: B007 - each() reads it
            bench.run(seconds, each)
        return bench.moving_since(at)

    def test_a_robot_without_odometry_is_not_driven(self, bench):
        bench.take()
        assert self.moves(bench, seen=False) == []
        assert bench.report().reason == "no odometry yet"
        assert self.moves(bench, seen=True) != []

    def test_a_robot_is_stopped_one_second_after_its_last_odometry(self, bench):
        bench.take()
        assert self.moves(bench, seen=True)
        at = bench.now
        bench.hold(2.0, x=1.0)
        assert 0.9 < bench.moving_since(at)[-1].at - at < 1.1
        assert bench.report().reason == "no odometry for 1 s"

    def test_odometry_without_velocity_is_no_motion_measurement(self, bench):
        """As from a message without a twist, or with NaN."""
        bench.take()
        assert self.moves(bench, seen=True)
        at = bench.now

        def each():
            bench.handle(events.OdometryReceived(KEY, None))
            bench.drive(x=1.0)

        bench.run(2.0, each)
        assert 0.9 < bench.moving_since(at)[-1].at - at < 1.1
        assert bench.report().measured is None

    def test_a_robot_is_watched_only_while_an_operator_has_control(self, bench):
        bench.handle(events.OdometryReceived(KEY, Twist(0.1)))
        assert bench.report().measured is None
        bench.take()
        assert bench.did(actions.Watch) == [actions.Watch(KEY, True)]
        bench.handle(events.OdometryReceived(KEY, Twist(0.1)))
        bench.handle(events.EchoReceived(KEY, Twist(0.2, 0, -0.0)))
        bench.run(0.2)
        report = bench.report()
        assert report.measured == Twist(0.1).numbers
        assert report.echoed == Twist(0.2).numbers
        bench.send("a", op="release", robot="r1")
        assert bench.did(actions.Watch)[-1] == actions.Watch(KEY, False)
        bench.handle(events.EchoReceived(KEY, Twist(0.2)))
        bench.run(0.2)
        assert bench.report().measured is None
        assert bench.report().echoed is None


class TestReports:
    def test_velocities_are_reported_at_most_ten_times_a_second(self, bench):
        bench.drive_off()
        before = len(bench.of(protocol.RobotReport))
        n = iter(range(1000))

        def each():
            bench.handle(events.OdometryReceived(KEY, Twist(next(n) / 100)))
            bench.drive(x=1.0)

        bench.run(1.0, each)
        received = bench.of(protocol.RobotReport)[before:]
        assert 8 <= len(received) <= 11
        bench.run(0.2)
        assert bench.report().measured is None or bench.report().measured[0] == 0.19

    def test_a_sent_velocity_is_reported_with_its_sender(self, bench):
        bench.drive_off(x=0.5)
        sent = bench.of(protocol.SentTwist)
        assert sent[-1] == protocol.SentTwist("r1", 0.5, 0.0, 0.0, "a")
        bench.run(0.5)
        assert bench.of(protocol.SentTwist)[-1].by is None

    def test_reports_can_be_encoded_as_json(self, bench):
        bench.drive_off()
        for report in bench.of(protocol.RobotReport):
            json.dumps(msgspec.to_builtins(report), allow_nan=False)
