"""From one pair of hands to another: asked, granted, and only at standstill."""

import pytest
from gate_harness import KEY, ZERO, Bench, spec

from webmap.base.geometry import Twist
from webmap.gate import actions, commands, events, protocol


@pytest.fixture
def bench():
    """A drives, and there is no odometry."""
    bench = Bench().begin()
    bench.drive_off("a")
    return bench


@pytest.fixture
def seen():
    """A has a robot whose odometry is listened to."""
    bench = Bench().begin(spec(odometry_topic="/odom"))
    bench.take("a")
    return bench


def ask(bench, who="b"):
    bench.say(who, op="ask", robot="r1")


def grant(bench, who="a"):
    bench.say(who, op="grant", robot="r1")


def holder(bench):
    holder = bench.report().holder
    return None if holder is None else holder.connection


def moving(bench, seconds, speed, turn=0.0):
    twist = Twist(speed, 0.0, turn)
    bench.run(seconds, lambda: bench.tell(events.OdometryReceived(KEY, twist)))


class TestAsking:
    def test_the_holder_sees_who_asks_and_drives_on(self, bench):
        ask(bench)
        assert bench.report().asker == protocol.AskerReport("b", "B", 10.0)
        bench.hold(1.0, x=1.0)
        assert bench.report().asker.left == pytest.approx(9.0, abs=0.2)
        assert bench.state == "driving"
        assert bench.written[-1].twist != ZERO

    def test_the_time_that_is_left_is_told_ten_times_a_second_at_most(self, bench):
        bench.run(2.0)
        ask(bench)
        before = len(bench.of(protocol.RobotReport))
        bench.hold(1.0)
        assert len(bench.of(protocol.RobotReport)) - before <= 14

    def test_who_does_not_answer_for_ten_seconds_has_granted_it(self, bench):
        ask(bench)
        bench.hold(9.9, x=1.0)
        assert holder(bench) == "a"
        bench.hold(0.2, x=1.0)
        assert holder(bench) is None
        assert bench.report().changing
        bench.run(1.1)
        assert holder(bench) == "b"

    def test_denied_it_stays_where_it_is(self, bench):
        ask(bench)
        bench.say("a", op="deny", robot="r1")
        assert bench.report().asker is None
        refused = bench.refusals("b")[-1]
        assert (refused.what, refused.why) == ("ask", "A keeps control")
        bench.hold(12.0, x=1.0)
        assert holder(bench) == "a"

    def test_asking_twice_does_not_win_time(self, bench):
        ask(bench)
        bench.hold(5.0)
        ask(bench)
        assert bench.report().asker.left == pytest.approx(5.0, abs=0.2)

    def test_one_asks_at_a_time(self, bench):
        bench.join("c")
        ask(bench)
        ask(bench, "c")
        assert bench.refusals("c")[-1].why == "B has already requested control"

    def test_the_question_can_be_taken_back(self, bench):
        ask(bench)
        bench.say("b", op="release", robot="r1")
        assert bench.report().asker is None
        bench.hold(12.0)
        assert holder(bench) == "a"

    @pytest.mark.parametrize("loss", ["page", "stop", "declared"])
    def test_it_ends_with_its_reason(self, bench, loss):
        ask(bench)
        match loss:
            case "page":
                bench.tell(protocol.Disconnect("b"))
            case "stop":
                bench.say("a", op="stop", robot="r1")
                assert bench.refusals("b")[-1].why == "STOP by A"
            case "declared":
                bench.tell(spec(v_max=0.5))
        assert bench.report().asker is None
        bench.run(12.0)
        assert holder(bench) != "b"

    @pytest.mark.parametrize("going", ["release", "lost"])
    def test_a_holder_who_goes_leaves_it_to_who_asks(self, bench, going):
        ask(bench)
        if going == "release":
            bench.say("a", op="release", robot="r1")
        else:
            bench.tell(protocol.Disconnect("a"))
        assert bench.report().changing
        bench.run(1.1)
        assert holder(bench) == "b"

    def test_what_makes_no_sense_is_refused(self, bench):
        bench.join("v", "viewer")
        ask(bench, "v")
        assert "operator" in bench.refusals("v")[-1].why
        ask(bench, "a")
        assert bench.refusals("a")[-1].why == "you already have control"
        grant(bench)
        assert bench.refusals("a")[-1].why == "no operator requests control"
        grant(bench, "b")
        assert (
            bench.refusals("b")[-1].why
            == "only the operator who has control can answer"
        )
        bench.say("a", op="release", robot="r1")
        ask(bench)
        assert bench.refusals("b")[-1].why == "no operator has control: take control"
        bench.say("a", op="stop", robot="r1")
        ask(bench)
        assert "STOP by A is active" in bench.refusals("b")[-1].why

    def test_an_asker_without_a_name_is_called_by_its_connection(self, bench):
        bench.tell(protocol.Connect("c9", "", "operator"))
        ask(bench, "c9")
        ask(bench, "b")
        assert bench.refusals("b")[-1].why == "c9 has already requested control"


class TestChanging:
    def test_zero_comes_first_and_the_new_driver_starts_disarmed(self, bench):
        ask(bench)
        bench.run(0.05)
        before, first = len(bench.written), bench.report().epoch
        grant(bench)
        assert bench.written[before].twist == ZERO
        report = bench.report()
        assert (report.changing, report.holder, report.armable) == (True, None, False)
        assert report.reason == "control goes to B when the robot has stopped"
        assert bench.refusals("a")[-1].why == "control goes to B"
        at = bench.now
        bench.run(1.1, lambda: bench.drive("a", x=1.0, epoch=first))
        assert bench.moving_since(at) == []
        report = bench.report()
        assert (report.holder.connection, report.armed) == ("b", False)
        assert report.epoch > first
        bench.hold(0.5, "b", x=1.0)
        assert bench.moving_since(at) == []
        bench.hold(0.3, "b")
        bench.hold(0.1, "b", x=1.0)
        assert bench.moving_since(at)[0].epoch == report.epoch

    def test_without_odometry_a_second_after_zero_is_standstill(self, bench):
        ask(bench)
        grant(bench)
        bench.run(0.95)
        assert holder(bench) is None
        assert bench.written[-1].at > bench.now - 0.06, "zero all the while"
        bench.run(0.1)
        assert holder(bench) == "b"

    def test_it_waits_while_the_robot_moves_on(self, seen):
        ask(seen)
        grant(seen)
        moving(seen, 5.0, 0.3)
        assert holder(seen) is None
        assert seen.written[-1].at > seen.now - 0.06, "zero all the while"
        moving(seen, 1.0, 0.0, turn=0.1)
        assert holder(seen) is None
        moving(seen, 0.4, 0.01)
        assert holder(seen) == "b"

    def test_it_waits_a_second_after_odometry_fell_silent(self, seen):
        ask(seen)
        grant(seen)
        moving(seen, 2.0, 0.3)
        seen.run(0.9)
        assert holder(seen) is None
        seen.run(0.2)
        assert holder(seen) == "b"

    def test_a_goal_is_cancelled_for_what_follows_one_does_not_stand(self, seen):
        seen.goal()
        ask(seen)
        cancels = len(seen.did(actions.CancelGoals))
        grant(seen)
        assert len(seen.did(actions.CancelGoals)) == cancels + 1

    def test_others_do_not_get_between(self, bench):
        bench.join("c")
        ask(bench)
        grant(bench)
        bench.take("c")
        assert (
            bench.refusals("c")[-1].why
            == "control goes to B when the robot has stopped"
        )
        ask(bench, "c")
        assert "control goes to B" in bench.refusals("c")[-1].why
        bench.tell(protocol.FromProgram(commands.Take("r1"), 1))
        assert bench.of(protocol.TakeReply)[-1].epoch is None

    @pytest.mark.parametrize("going", ["release", "lost"])
    def test_an_heir_who_goes_leaves_it_free(self, bench, going):
        ask(bench)
        grant(bench)
        if going == "release":
            bench.say("b", op="release", robot="r1")
        else:
            bench.tell(protocol.Disconnect("b"))
        bench.run(2.0)
        assert bench.report().state == "free"
        assert not bench.report().changing

    def test_stop_ends_it(self, bench):
        ask(bench)
        grant(bench)
        bench.say("a", op="stop", robot="r1")
        bench.run(2.0)
        assert holder(bench) is None
        assert bench.refusals("b")[-1].why == "STOP by A"
        assert "STOP" in bench.report().reason

    def test_a_link_that_breaks_ends_it_and_says_so(self, bench):
        ask(bench)
        grant(bench)
        bench.break_links()
        bench.run(0.1)
        assert "no connection" in bench.refusals("b")[-1].why
        assert not bench.report().changing

    def test_a_robot_that_takes_goals_only_changes_hands_too(self):
        bench = Bench().begin(spec(twist_topic=None))
        bench.take("a")
        ask(bench)
        grant(bench)
        bench.run(1.1)
        assert holder(bench) == "b"
        assert bench.did(actions.WriteTwist) == []

    def test_the_limit_of_the_new_page_counts(self, bench):
        ask(bench)
        grant(bench)
        bench.tell(protocol.Speeds("b", 0.2, 0.2))
        bench.run(1.1)
        assert bench.report().v == 0.2
