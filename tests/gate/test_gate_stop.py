"""STOP: it is active until a reset, also in a new gate, and odometry confirms it."""

import json

import pytest

from equipment.gate_harness import KEY, URL, ZERO, Bench, spec
from webmap.base.errors import ConfigError
from webmap.base.geometry import Twist
from webmap.config.motion import StopHook
from webmap.gate import actions, commands, events, protocol
from webmap.gate.events import Key, Press
from webmap.gate.protocol import PROGRAM
from webmap.gate.specs import checked


@pytest.fixture
def bench():
    return Bench().begin()


@pytest.fixture
def seen():
    """A bench with a robot that has odometry."""
    return Bench().begin(spec(odometry_topic="/odom"))


def stop(bench, who="b", robot="r1"):
    bench.send(who, op="stop", robot=robot)


def reset(bench, who="b", robot="r1"):
    bench.send(who, op="reset", robot=robot)


def verdict(bench):
    """Return the user, the confirmation and the reason of the active STOP."""
    stop = bench.report().stop
    return stop.by, stop.confirmed, stop.why


def watch_it(bench, seconds, *speeds):
    """Let odometry report ``speeds``, one every 50 ms; the last one is repeated."""
    wanted = iter(speeds)
    now = [0.0]

    def each():
        now[0] = next(wanted, now[0])
        bench.handle(events.OdometryReceived(KEY, Twist(now[0])))

    bench.run(seconds, each)


class TestLatch:
    def test_nobody_can_take_a_robot_while_a_stop_is_active(self, bench):
        bench.drive_off()
        stop(bench)
        report = bench.report()
        assert (report.latched, report.state) == (True, "stopped")
        assert not report.armable
        assert report.reason == "STOP by B is active: reset it first"
        assert bench.take("a") is None
        bench.run(5.0)
        assert bench.take("b") is None
        bench.handle(protocol.FromProgram(commands.Take("r1"), 1))
        assert bench.of(protocol.TakeReply)[-1].epoch is None
        assert bench.report().latched

    def test_no_command_and_no_goal_is_sent_while_a_stop_is_active(self, bench):
        epoch = bench.drive_off()
        stop(bench)
        at = bench.now
        bench.run(1.0, lambda: bench.drive(x=1.0, epoch=epoch))
        bench.goal(epoch=epoch)
        bench.handle(
            protocol.FromProgram(
                commands.SetVelocity("r1", epoch, bench.tick, (1.0, 0, 0))
            )
        )
        bench.handle(
            protocol.FromProgram(commands.Goal("r1", epoch, 0, bench.tick, 1.0, 0, 0))
        )
        assert bench.moving_since(at) == []
        assert bench.did(actions.SendGoal) == []

    def test_a_stop_sends_zeros_at_10_hz_for_a_limited_time(self, bench):
        stop(bench)
        bench.run(1.0)
        at = bench.now
        bench.run(5.0)
        zeros = bench.since(at)
        assert {w.twist for w in zeros} == {ZERO}
        assert 49 <= len(zeros) <= 51
        bench.now += 600
        bench.run(0.2)
        at = bench.now
        bench.run(5.0)
        assert bench.since(at) == []
        assert bench.report().latched
        assert bench.take() is None
        stop(bench)
        assert bench.since(at - 0.01)[0].twist == ZERO
        bench.run(1.0)
        assert bench.written[-1].at > bench.now - 0.11

    def test_a_stop_writes_no_zeros_while_the_link_is_down(self, bench):
        stop(bench)
        bench.break_links()
        bench.run(1.0)
        before = len(bench.dropped)
        bench.run(2.0)
        assert len(bench.dropped) == before

    def test_the_zero_of_a_stop_is_sent_before_any_disk_write(self, bench):
        bench.done.clear()
        stop(bench)
        kinds = [type(each) for each in bench.done]
        disk = (actions.MarkDriven, actions.SaveStop)
        first = min(kinds.index(kind) for kind in disk)
        assert kinds.index(actions.WriteTwist) < first

    def test_a_stop_sends_zero_first_on_a_new_link(self, bench):
        bench.drive_off()
        stop(bench)
        bench.break_links()
        bench.run(20.0)
        at, cancels = bench.now, len(bench.did(actions.CancelGoals))
        bench.connect_links()
        assert [w.twist for w in bench.written if w.at >= at] == [ZERO]
        assert len(bench.did(actions.CancelGoals)) == cancels + 1
        bench.run(2.0)
        assert bench.written[-1].at > bench.now - 0.11

    def test_a_reset_sends_no_velocity_and_gives_nobody_control(self, bench):
        epoch = bench.drive_off()
        stop(bench)
        bench.run(1.0, lambda: bench.drive(x=1.0, epoch=epoch))
        at, before = bench.now, len(bench.written)
        reset(bench)
        assert len(bench.written) == before
        report = bench.report()
        assert (report.latched, report.stop, report.holder) == (False, None, None)
        assert (report.state, report.armable) == ("free", True)
        bench.run(1.0, lambda: bench.drive(x=1.0, epoch=epoch))
        assert bench.since(at) == []

    def test_a_key_held_before_and_after_the_reset_moves_nothing(self, bench):
        bench.drive_off()
        stop(bench)
        bench.hold(0.5, x=1.0)
        reset(bench)
        bench.take("a")
        at = bench.now
        bench.hold(1.0, x=1.0)
        assert bench.moving_since(at) == []
        bench.hold(0.3)
        bench.hold(0.1, x=1.0)
        assert bench.moving_since(at) != []

    def test_a_reset_needs_an_operator_and_an_active_stop(self, bench):
        bench.join("v", "viewer")
        reset(bench)
        assert bench.refusals("b")[-1].why == "no STOP is active"
        stop(bench, "v")
        reset(bench, "v")
        assert "operator" in bench.refusals("v")[-1].why
        assert bench.report().latched
        reset(bench, "b", "r9")
        assert "'r9'" in bench.refusals("b")[-1].why

    def test_stop_all_stops_every_robot_and_each_needs_its_own_reset(self):
        other = "/r2/cmd_vel"
        bench = Bench().begin(spec(), spec(id="r2", twist_topic=other))
        stop(bench, robot="*")
        assert bench.report("r1").latched
        assert bench.report("r2").latched
        reset(bench, robot="r1")
        assert not bench.report("r1").latched
        assert bench.report("r2").latched
        reset(bench, robot="r2")
        assert not bench.report("r2").latched
        assert bench.refusals("b") == []

    def test_a_program_can_stop_a_robot_and_reset_the_stop(self, bench):
        bench.handle(protocol.FromProgram(commands.Stop("r1")))
        assert bench.report().stop.by == PROGRAM
        bench.handle(protocol.FromProgram(commands.Reset("r1", bench.stop_of())))
        assert not bench.report().latched
        bench.handle(protocol.FromProgram(commands.Reset("r1", bench.stop_of())))
        assert bench.refusals(PROGRAM)[-1].what == "reset"

    def test_a_stop_stays_active_when_the_robot_is_declared_again(self, bench):
        stop(bench)
        bench.handle(spec(v_max=0.5))
        assert bench.report().latched
        bench.handle(protocol.Forget("r1"))
        bench.run(1.0)
        assert bench.did(actions.Detach)
        bench.handle(spec())
        assert bench.report().latched
        assert bench.take() is None
        reset(bench)
        assert bench.take()

    def test_removing_a_stopped_robot_stops_watching_its_odometry(self):
        bench = Bench().begin(spec(odometry_topic="/odom"))
        stop(bench)
        bench.run(0.6)
        assert bench.did(actions.Watch)[-1].on
        bench.handle(protocol.Forget("r1"))
        kept = (actions.Watch, actions.Detach)
        last = [a for a in bench.done if isinstance(a, kept)][-2:]
        assert last == [actions.Watch(KEY, False), actions.Detach(KEY, "r1")]

    def test_a_repeated_lock_failure_does_not_revoke_the_confirmation_of_a_stop(self):
        bench = Bench(lock_held=False).begin(spec(odometry_topic="/odom"))
        stop(bench)
        watch_it(bench, 0.5, 0.0)
        assert bench.report().stop.confirmed
        bench.handle(events.LockState(KEY, held=False, why="another has it"))
        assert bench.report().stop.confirmed

    def test_two_robots_on_one_machine_share_a_stop(self):
        bench = Bench().begin(spec(), spec(id="r2"))
        stop(bench, robot="r1")
        assert bench.report("r2").latched
        assert bench.take("a", "r2") is None

    def test_a_robot_without_a_velocity_topic_can_be_stopped(self):
        bench = Bench().begin(spec(twist_topic=None))
        stop(bench)
        assert bench.report().latched
        assert bench.report().stop.why == "no odometry"
        assert bench.take() is None
        bench.handle(events.LinkDown(URL, "tasks"))
        stop(bench)
        bench.run(0.2)
        assert bench.report().stop.why == f"no connection to {URL}"
        assert bench.written == bench.dropped == []


class TestChangedKey:
    """The key of a robot is its velocity topic, or else its goal topic."""

    ONLY_GOALS = spec(twist_topic=None)
    GOALS = Key(URL, "goal /goal")

    @pytest.fixture
    def bench(self):
        bench = Bench().begin(self.ONLY_GOALS)
        stop(bench)
        return bench

    def test_a_stopped_robot_that_gets_a_velocity_topic_stays_stopped(self, bench):
        bench.handle(spec())
        assert bench.written[-1].twist == ZERO
        assert bench.stops == {self.GOALS: "B", KEY: "B"}
        assert bench.report().latched
        assert bench.report().stop.by == "B"
        assert bench.take() is None
        bench.goal()
        assert bench.did(actions.SendGoal) == []
        reset(bench)
        assert not bench.report().latched
        bench.drive_off()
        assert bench.written[-1].twist == Twist(1.0)

    def test_a_stopped_robot_that_loses_its_velocity_topic_stays_stopped(self):
        bench = Bench().begin()
        bench.drive_off()
        stop(bench)
        bench.handle(self.ONLY_GOALS)
        bench.run(1.0)
        assert bench.report().latched
        assert bench.take() is None
        assert bench.did(actions.CancelGoals)[-1].key == self.GOALS
        reset(bench)
        assert bench.take()

    def test_a_reset_also_ends_the_stop_under_the_key_that_the_robot_is_leaving(self):
        bench = Bench().begin()
        bench.drive_off()
        stop(bench)
        bench.handle(self.ONLY_GOALS)
        reset(bench)
        assert bench.stops == {}

    def test_a_reset_ends_the_stop_under_every_earlier_key_of_the_robot(self, bench):
        bench.handle(spec())
        bench.handle(spec(twist_topic="/other"))
        bench.run(1.0)
        reset(bench)
        assert bench.stops == {}
        bench.handle(self.ONLY_GOALS)
        assert bench.take()

    def test_a_reset_does_not_end_the_stop_of_another_robot_with_the_old_key(self):
        bench = Bench().begin(self.ONLY_GOALS, spec(id="r2", twist_topic=None))
        stop(bench)
        bench.handle(spec())
        reset(bench)
        assert not bench.report("r1").latched
        assert bench.report("r2").latched
        assert bench.stops == {self.GOALS: "B"}

    def test_a_stop_that_was_reset_under_the_old_key_is_not_reset_again(self, bench):
        bench.handle(spec())
        bench.handle(spec(id="r2", twist_topic=None))
        reset(bench, robot="r2")
        bench.handle(protocol.Forget("r2"))
        kept = len(bench.did(actions.SaveStop))
        reset(bench)
        assert len(bench.did(actions.SaveStop)) == kept + 1

    def test_a_robot_that_was_not_stopped_is_not_stopped_under_its_new_key(self):
        bench = Bench().begin(self.ONLY_GOALS)
        bench.handle(spec())
        assert not bench.report().latched
        assert bench.take()


class TestDisk:
    def test_zero_is_sent_before_the_disk_write_and_the_report_afterwards(self):
        bench = Bench(slow_disk=True).begin()
        bench.drive_off()
        stop(bench)
        kept = (actions.WriteTwist, actions.SaveStop)
        last = [a for a in bench.done if isinstance(a, kept)][-2:]
        assert last[0].twist == ZERO
        assert (last[1].number, last[1].press.by) == (1, "B")
        bench.run(1.0)
        assert not bench.report().latched
        assert bench.report().stop is None
        assert bench.take() is None
        bench.keep(last[1])
        assert bench.report().latched

    def test_only_the_newest_of_several_stops_during_a_disk_write_is_saved(self):
        bench = Bench(slow_disk=True).begin()
        for who in "babab":
            stop(bench, who)
        (first,) = bench.did(actions.SaveStop)
        bench.keep(first)
        assert bench.report().stop.by == "B"
        _, newest = bench.did(actions.SaveStop)
        bench.keep(newest)
        assert len(bench.did(actions.SaveStop)) == 2
        assert bench.report().stop.id == newest.press.id
        assert newest.press.id != first.press.id

    def test_the_earlier_stop_is_shown_and_not_reset_while_a_newer_stop_is_saved(self):
        bench = Bench().begin()
        stop(bench, "b")
        bench.slow_disk = True
        stop(bench, "a")
        assert (bench.report().latched, bench.report().stop.by) == (True, "B")
        reset(bench)
        assert "A pressed STOP meanwhile" in bench.refusals("b")[-1].why
        assert bench.report().latched

    def test_only_the_answer_to_the_newest_disk_write_changes_the_report(self):
        bench = Bench(slow_disk=True).begin()
        stop(bench)
        (only,) = bench.did(actions.SaveStop)
        bench.send("b", op="reset", robot="r1", stop=only.press.id)
        stop(bench)
        first, second, third = bench.did(actions.SaveStop)
        bench.keep(first)
        bench.keep(second)
        bench.run(0.1)
        assert not bench.report().latched
        bench.keep(third)
        assert bench.report().latched

    def test_the_stop_of_a_removed_robot_is_still_saved(self):
        bench = Bench(slow_disk=True).begin()
        stop(bench)
        bench.handle(protocol.Forget("r1"))
        bench.run(1.0)
        bench.keep(bench.did(actions.SaveStop)[-1])
        bench.handle(spec())
        assert bench.report().latched

    def test_a_full_disk_is_reported_and_the_stop_stays_active(self):
        bench = Bench(full_disk=True).begin()
        stop(bench)
        assert bench.report().latched
        assert "the disk is full" in bench.report().stop.why
        bench.full_disk = False
        stop(bench)
        assert bench.stops == {KEY: "B"}
        assert "disk" not in bench.report().stop.why

    def test_a_new_gate_enforces_a_saved_stop_until_its_reset(self):
        old = Bench().begin()
        stop(old)
        bench = Bench(disk=old.disk)
        bench.begin()
        assert bench.written[0].twist == ZERO
        assert bench.did(actions.CancelGoals)
        assert bench.did(actions.SaveStop) == []
        report = bench.report()
        assert (report.latched, report.stop.by) == (True, "B")
        assert bench.drive_off() is None
        assert bench.moving_since(0) == []
        reset(bench)
        assert bench.stops == {}
        assert bench.drive_off()
        assert bench.moving_since(0)

    def test_every_report_of_a_new_gate_shows_the_saved_stop(self):
        bench = Bench(disk={KEY: Press("B", "b1")}).begin()
        assert all(r.latched for r in bench.of(protocol.RobotReport))

    def test_a_saved_stop_sends_zeros_only_after_the_gate_gets_the_lock(self):
        bench = Bench(disk={KEY: Press("B", "b1")}, lock_held=False).begin()
        bench.run(1.0)
        assert bench.written == []
        bench.handle(events.LockState(KEY, held=True, latched=Press("B", "b1")))
        assert bench.written[0].twist == ZERO
        bench.handle(events.LockState(KEY, held=True, latched=Press("Z", "z1")))
        assert bench.report().stop.by == "Z", "another gate received a STOP meanwhile"


class TestConfirmation:
    def test_a_stop_is_confirmed_after_300_ms_of_standstill(self, seen):
        stop(seen)
        assert verdict(seen) == ("B", None, "")
        watch_it(seen, 0.4, 0.4, 0.2)
        assert seen.report().stop.confirmed is None
        watch_it(seen, 0.4, 0.01)
        assert seen.report().stop.confirmed is True

    def test_a_lost_link_revokes_the_confirmation_of_a_stop(self, seen):
        stop(seen)
        watch_it(seen, 0.4, 0.0)
        assert seen.report().stop.confirmed is True
        seen.break_links()
        seen.run(0.2)
        received = seen.report().stop
        assert (received.confirmed, received.why) == (
            False,
            f"the robot stopped, but now: no connection to {URL}",
        )
        seen.connect_links()
        watch_it(seen, 0.4, 0.0)
        assert seen.report().stop.confirmed is True

    def test_a_one_second_gap_in_odometry_does_not_revoke_the_confirmation(self, seen):
        stop(seen)
        watch_it(seen, 0.4, 0.0)
        seen.run(1.0)
        assert seen.report().stop.confirmed is True
        watch_it(seen, 0.05, 0.0)
        assert seen.report().stop.confirmed is True

    def test_odometry_at_1_hz_does_not_confirm_a_stop(self, seen):
        stop(seen)
        for _ in range(4):
            watch_it(seen, 0.01, 0.0)
            seen.run(0.99)
        too_seldom = "only one odometry message in 1.0 s"
        assert verdict(seen) == ("B", False, too_seldom)

    def test_a_robot_that_has_just_stopped_is_reported_as_not_yet_still(self, seen):
        stop(seen)
        watch_it(seen, 1.9, 0.4)
        watch_it(seen, 0.2, 0.0)
        assert verdict(seen) == ("B", False, "not yet still for 0.3 s")
        watch_it(seen, 0.2, 0.0)
        assert seen.report().stop.confirmed is True

    @pytest.mark.slow
    def test_later_silence_or_motion_revokes_the_confirmation_of_a_stop(self, seen):
        """The cause may be a late goal, a ramp or another program."""
        stop(seen)
        watch_it(seen, 0.4, 0.0)
        seen.run(60.0)
        assert seen.did(actions.Watch)[-1] == actions.Watch(KEY, True)
        since = "the robot stopped, but now: no odometry"
        assert verdict(seen) == ("B", False, since)
        watch_it(seen, 0.2, 0.4)
        assert verdict(seen) == ("B", False, "still moving at 0.40 m/s")
        watch_it(seen, 0.4, 0.0)
        assert seen.report().stop.confirmed is True
        reset(seen)
        seen.run(2.0)
        assert seen.did(actions.Watch)[-1] == actions.Watch(KEY, False)

    def test_a_stop_of_a_moving_robot_is_not_confirmed_until_standstill(self, seen):
        stop(seen)
        watch_it(seen, 2.1, 0.31)
        assert verdict(seen) == ("B", False, "still moving at 0.31 m/s")
        watch_it(seen, 0.5, 0.0)
        assert seen.report().stop.confirmed is True

    def test_a_stop_of_a_turning_robot_is_not_confirmed(self, seen):
        stop(seen)
        seen.run(
            1.0, lambda: seen.handle(events.OdometryReceived(KEY, Twist(0, 0, 0.1)))
        )
        assert seen.report().stop.confirmed is None
        seen.run(
            1.1, lambda: seen.handle(events.OdometryReceived(KEY, Twist(0, 0, 0.1)))
        )
        assert seen.report().stop.why == "still turning at 0.10 rad/s"

    def test_odometry_with_long_gaps_does_not_confirm_a_stop(self, seen):
        stop(seen)
        for _ in range(3):
            seen.handle(events.OdometryReceived(KEY, ZERO))
            seen.run(0.6)
        assert seen.report().stop.confirmed is None

    def test_standstill_before_the_stop_does_not_confirm_the_stop(self, seen):
        seen.take()
        watch_it(seen, 0.5, 0.0)
        stop(seen)
        watch_it(seen, 0.1, 0.0)
        assert seen.report().stop.confirmed is None

    @pytest.mark.parametrize("received", [[], [None]])
    def test_missing_or_empty_odometry_does_not_confirm_a_stop(self, seen, received):
        stop(seen)
        for twist in received:
            seen.handle(events.OdometryReceived(KEY, twist))
        seen.run(2.2)
        assert verdict(seen) == ("B", False, "no odometry")

    def test_odometry_that_ends_after_the_stop_is_reported_as_no_odometry(self, seen):
        stop(seen)
        watch_it(seen, 0.2, 0.3)
        seen.run(2.5)
        assert seen.report().stop.why == "no odometry"

    def test_a_stop_of_a_robot_without_odometry_is_not_confirmed(self, bench):
        stop(bench)
        assert verdict(bench) == ("B", False, "no odometry")

    def test_a_stop_without_a_link_can_be_confirmed_after_the_link_is_up(self, seen):
        seen.break_links()
        stop(seen)
        assert verdict(seen) == ("B", False, f"no connection to {URL}")
        seen.connect_links()
        assert seen.report().stop.confirmed is None
        watch_it(seen, 0.6, 0.0)
        assert seen.report().stop.confirmed is True

    def test_a_stop_is_confirmed_only_after_the_bridge_answers(self, seen):
        seen.answering = False
        seen.run(0.2)
        stop(seen)
        watch_it(seen, 0.6, 0.0)
        assert seen.report().stop.confirmed is None
        seen.answering = True
        watch_it(seen, 0.1, 0.0)
        assert seen.report().stop.confirmed is True

    def test_a_bridge_that_never_answers_is_the_reason_for_no_confirmation(self):
        from webmap.gate.rules.stop import Confirmation

        confirmation = Confirmation()
        confirmation.begin(0.0)
        confirmation.judge(None, delivered=False, now=2.5)
        assert confirmation.why == "no answer from the bridge"


class TestHooks:
    HOOKS = (
        StopHook(topic="/lock", type="std_msgs/Bool"),
        StopHook(service="/e_stop", type="std_srvs/Trigger"),
    )

    @pytest.fixture
    def bench(self):
        return Bench().begin(spec(stop_hooks=self.HOOKS))

    def runs(self, bench):
        hooks = bench.did(actions.RunHook)
        return [(h.hook.name, h.stopped) for h in hooks]

    def test_hooks_run_on_stop_and_a_reset_clears_only_the_topic_hook(self, bench):
        stop(bench)
        assert self.runs(bench) == [("/lock", True), ("/e_stop", True)]
        reset(bench)
        assert self.runs(bench)[2:] == [("/lock", False)]

    def test_hooks_run_after_the_zero_is_sent(self, bench):
        bench.drive_off()
        stop(bench)
        kept = (actions.WriteTwist, actions.RunHook)
        last = [a for a in bench.done if isinstance(a, kept)][-3:]
        assert isinstance(last[0], actions.WriteTwist)

    def test_hooks_run_again_on_a_new_link(self, bench):
        stop(bench)
        bench.break_links()
        bench.connect_links()
        assert self.runs(bench)[2:] == [("/lock", True), ("/e_stop", True)]

    def test_a_topic_hook_not_cleared_by_reset_is_cleared_once_on_the_next_link(
        self, bench
    ):
        stop(bench)
        bench.break_links()
        reset(bench)
        assert len(self.runs(bench)) == 2
        bench.connect_links()
        bench.connect_links()
        assert self.runs(bench)[2:] == [("/lock", False)]

    def test_hooks_run_on_the_velocity_bridge_and_not_on_the_goal_bridge(self):
        other = "ws://nav:9090"
        bench = Bench().begin(spec(stop_hooks=self.HOOKS, goal_url=other))
        stop(bench)
        assert len(self.runs(bench)) == 2
        bench.handle(events.LinkUp(other, "tasks"))
        assert len(self.runs(bench)) == 2

    @pytest.mark.parametrize(
        "hook",
        [
            {},
            {"topic": "/lock", "service": "/lock"},
            {"topic": "/lock", "type": "std_msgs/String"},
            {"service": "/e_stop", "type": "std_msgs/Bool"},
            {"topic": "cmd_vel"},
        ],
    )
    def test_an_invalid_stop_hook_raises_config_error(self, hook):
        with pytest.raises(ConfigError, match=r"stop_hooks\[0\]"):
            checked(spec(stop_hooks=(StopHook(**hook),)))

    def test_a_stop_hook_gets_its_default_type_and_full_name(self):
        (hook,) = checked(spec(stop_hooks=(StopHook(topic="lock"),))).base.stop_hooks
        assert hook == StopHook(topic="/lock", type="std_msgs/Bool")


def test_a_stop_of_one_robot_does_not_stop_other_machines():
    other = "/r2/cmd_vel"
    bench = Bench().begin(spec(), spec(id="r2", twist_topic=other))
    stop(bench)
    assert not bench.report("r2").latched
    assert {w.key for w in bench.written} == {KEY}
    assert Key(URL, other) not in bench.disk


class TestResetOfAStop:
    def test_a_reset_does_not_end_a_newer_stop_of_another_operator(self, bench):
        stop(bench, "a")
        seen = bench.stop_of()
        stop(bench, "b")
        bench.send("a", op="reset", robot="r1", stop=seen)
        assert bench.report().latched
        assert bench.refusals("a")[-1].why == (
            "B pressed STOP meanwhile; look at the robot, then press Reset again"
        )
        reset(bench, "a")
        assert not bench.report().latched

    def test_a_reset_does_not_end_a_newer_stop_of_the_same_operator(self, bench):
        stop(bench)
        seen = bench.stop_of()
        stop(bench)
        bench.send("b", op="reset", robot="r1", stop=seen)
        assert bench.report().latched

    def test_a_repeated_reset_does_not_end_a_stop_pressed_after_the_first_reset(
        self, bench
    ):
        stop(bench)
        seen = bench.stop_of()
        reset(bench)
        stop(bench, "a")
        bench.send("b", op="reset", robot="r1", stop=seen)
        assert bench.report().latched

    def test_a_reset_does_not_end_a_newer_stop_that_another_gate_saved(self, bench):
        stop(bench)
        seen = bench.stop_of()
        bench.disk[KEY] = Press("Ann", "a1")
        bench.handle(events.StopFileChanged(KEY, Press("Ann", "a1")))
        assert bench.report().stop.by == "Ann"
        bench.send("b", op="reset", robot="r1", stop=seen)
        assert bench.report().latched
        reset(bench)
        assert not bench.report().latched
        assert bench.disk == {}

    def test_a_reset_does_not_delete_an_unseen_stop_file_of_another_gate(self, bench):
        stop(bench)
        bench.disk[KEY] = Press("Ann", "a1")
        reset(bench)
        assert bench.stops == {KEY: "Ann"}, "its file is not removed"
        bench.handle(events.StopFileChanged(KEY, Press("Ann", "a1")))
        assert bench.report().latched

    def test_a_reset_by_a_program_does_not_end_a_newer_stop(self, bench):
        bench.handle(protocol.FromProgram(commands.Stop("r1")))
        seen = bench.stop_of()
        stop(bench)
        bench.handle(protocol.FromProgram(commands.Reset("r1", seen)))
        assert bench.report().latched
        assert "B pressed STOP" in bench.refusals(PROGRAM)[-1].why

    def test_a_stop_keeps_its_identity_after_a_restart_of_the_gate(self):
        old = Bench().begin()
        stop(old)
        seen = old.stop_of()
        bench = Bench(disk=old.disk).begin()
        assert bench.stop_of() == seen
        bench.send("b", op="reset", robot="r1", stop=seen)
        assert not bench.report().latched

    def test_a_reset_without_a_valid_stop_identity_is_refused(self, bench):
        stop(bench)
        for stated in ({}, {"stop": ""}, {"stop": 7}, {"stop": "x" * 65}):
            command = {"op": "reset", "robot": "r1", **stated}
            bench.handle(protocol.FromPage("b", json.dumps(command).encode()))
            bench.run(1.1)
        assert len(bench.refusals("b")) == 4
        assert bench.report().latched

    def test_a_second_stop_during_a_disk_write_is_saved_after_the_first(self):
        bench = Bench(slow_disk=True).begin()
        stop(bench)
        stop(bench, "a")
        bench.handle(events.StopFileChanged(KEY, bench.did(actions.SaveStop)[0].press))
        assert len(bench.did(actions.SaveStop)) == 1
        bench.keep(bench.did(actions.SaveStop)[0])
        bench.keep(bench.did(actions.SaveStop)[1])
        assert bench.report().stop.by == "A"

    def test_a_reset_after_a_topic_change_does_not_end_a_newer_stop_all(self, bench):
        stop(bench)
        bench.handle(spec(twist_topic="/other/cmd_vel"))
        seen = bench.stop_of()
        stop(bench, "a", "*")
        bench.send("b", op="reset", robot="r1", stop=seen)
        assert bench.report().latched
        reset(bench)
        assert not bench.report().latched
        assert bench.disk == {}, "under both topics"

    def test_a_reset_does_not_delete_a_stop_of_another_gate_on_the_old_topic(
        self, bench
    ):
        stop(bench)
        bench.handle(spec(twist_topic="/other/cmd_vel"))
        bench.run(1.0)
        bench.disk[KEY] = Press("Ann", "a1")
        reset(bench)
        assert bench.stops == {KEY: "Ann"}
