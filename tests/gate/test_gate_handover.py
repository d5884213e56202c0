"""Control changes to another operator: on request, and only at standstill."""

import pytest

from equipment.gate_harness import KEY, ZERO, Bench, spec
from webmap.base.geometry import Twist
from webmap.gate import actions, commands, events, protocol


@pytest.fixture
def bench():
    """A bench where A drives a robot without odometry."""
    bench = Bench().begin()
    bench.drive_off("a")
    return bench


@pytest.fixture
def seen():
    """A bench where A has control of a robot with odometry."""
    bench = Bench().begin(spec(odometry_topic="/odom"))
    bench.take("a")
    return bench


def ask(bench, who="b"):
    bench.send(who, op="ask", robot="r1")


def grant(bench, who="a"):
    bench.send(who, op="grant", robot="r1")


def holder(bench):
    holder = bench.report().holder
    return None if holder is None else holder.connection


def moving(bench, seconds, speed, turn=0.0):
    twist = Twist(speed, 0.0, turn)
    bench.run(seconds, lambda: bench.handle(events.OdometryReceived(KEY, twist)))


class TestRequest:
    def test_the_operator_sees_a_request_for_control_and_keeps_driving(self, bench):
        ask(bench)
        assert bench.report().asker == protocol.AskerReport("b", "B", 10.0)
        bench.hold(1.0, x=1.0)
        assert bench.report().asker.left == pytest.approx(9.0, abs=0.2)
        assert bench.state == "driving"
        assert bench.written[-1].twist != ZERO

    def test_the_time_left_to_answer_is_reported_about_ten_times_a_second_at_most(
        self, bench
    ):
        bench.run(2.0)
        ask(bench)
        before = len(bench.of(protocol.RobotReport))
        bench.hold(1.0)
        assert len(bench.of(protocol.RobotReport)) - before <= 14

    def test_a_request_without_an_answer_is_granted_after_ten_seconds(self, bench):
        ask(bench)
        bench.hold(9.9, x=1.0)
        assert holder(bench) == "a"
        bench.hold(0.2, x=1.0)
        assert holder(bench) is None
        assert bench.report().changing
        bench.run(1.1)
        assert holder(bench) == "b"

    def test_a_denied_request_leaves_control_with_the_operator(self, bench):
        ask(bench)
        bench.send("a", op="deny", robot="r1")
        assert bench.report().asker is None
        refused = bench.refusals("b")[-1]
        assert (refused.what, refused.why) == ("ask", "A keeps control")
        bench.hold(12.0, x=1.0)
        assert holder(bench) == "a"

    def test_a_repeated_request_does_not_restart_the_countdown(self, bench):
        ask(bench)
        bench.hold(5.0)
        ask(bench)
        assert bench.report().asker.left == pytest.approx(5.0, abs=0.2)

    def test_only_one_operator_can_request_control_at_a_time(self, bench):
        bench.join("c")
        ask(bench)
        ask(bench, "c")
        assert bench.refusals("c")[-1].why == "B has already requested control"

    def test_a_request_for_control_can_be_withdrawn(self, bench):
        ask(bench)
        bench.send("b", op="release", robot="r1")
        assert bench.report().asker is None
        bench.hold(12.0)
        assert holder(bench) == "a"

    @pytest.mark.parametrize("loss", ["page", "stop", "declared"])
    def test_a_request_ends_on_page_loss_stop_or_new_declaration(self, bench, loss):
        ask(bench)
        match loss:
            case "page":
                bench.handle(protocol.Disconnect("b"))
            case "stop":
                bench.send("a", op="stop", robot="r1")
                assert bench.refusals("b")[-1].why == "STOP by A"
            case "declared":
                bench.handle(spec(v_max=0.5))
        assert bench.report().asker is None
        bench.run(12.0)
        assert holder(bench) != "b"

    @pytest.mark.parametrize("going", ["release", "lost"])
    def test_control_goes_to_the_requester_when_the_operator_leaves(self, bench, going):
        ask(bench)
        if going == "release":
            bench.send("a", op="release", robot="r1")
        else:
            bench.handle(protocol.Disconnect("a"))
        assert bench.report().changing
        bench.run(1.1)
        assert holder(bench) == "b"

    def test_invalid_requests_and_answers_are_refused(self, bench):
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
        bench.send("a", op="release", robot="r1")
        ask(bench)
        assert bench.refusals("b")[-1].why == "no operator has control: take control"
        bench.send("a", op="stop", robot="r1")
        ask(bench)
        assert "STOP by A is active" in bench.refusals("b")[-1].why

    def test_a_requester_without_a_name_is_named_by_its_connection(self, bench):
        bench.handle(protocol.Connect("c9", "", "operator"))
        ask(bench, "c9")
        ask(bench, "b")
        assert bench.refusals("b")[-1].why == "c9 has already requested control"


class TestTransfer:
    def test_a_hand_over_sends_zero_and_the_new_operator_must_release_inputs(
        self, bench
    ):
        ask(bench)
        bench.run(0.05)
        before, first = len(bench.written), bench.report().epoch
        grant(bench)
        assert bench.written[before].twist == ZERO
        report = bench.report()
        assert (report.changing, report.holder, report.armable) == (True, None, False)
        assert report.reason == (
            "control is being handed over to B; the robot stops first"
        )
        assert bench.refusals("a")[-1].why == "control is handed over to B"
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

    def test_without_odometry_a_hand_over_ends_one_second_after_zero(self, bench):
        ask(bench)
        grant(bench)
        bench.run(0.95)
        assert holder(bench) is None
        assert bench.written[-1].at > bench.now - 0.06, "zeros until the end"
        bench.run(0.1)
        assert holder(bench) == "b"

    def test_a_hand_over_waits_while_the_robot_moves(self, seen):
        ask(seen)
        grant(seen)
        moving(seen, 5.0, 0.3)
        assert holder(seen) is None
        assert seen.written[-1].at > seen.now - 0.06, "zeros until the end"
        moving(seen, 1.0, 0.0, turn=0.1)
        assert holder(seen) is None
        moving(seen, 0.4, 0.01)
        assert holder(seen) == "b"

    def test_a_hand_over_waits_one_second_after_the_last_odometry(self, seen):
        ask(seen)
        grant(seen)
        moving(seen, 2.0, 0.3)
        seen.run(0.9)
        assert holder(seen) is None
        seen.run(0.2)
        assert holder(seen) == "b"

    def test_a_hand_over_cancels_the_goal(self, seen):
        seen.goal()
        ask(seen)
        cancels = len(seen.did(actions.CancelGoals))
        grant(seen)
        assert len(seen.did(actions.CancelGoals)) == cancels + 1

    def test_others_cannot_take_or_request_control_during_a_hand_over(self, bench):
        bench.join("c")
        ask(bench)
        grant(bench)
        bench.take("c")
        assert (
            bench.refusals("c")[-1].why
            == "control is being handed over to B; the robot stops first"
        )
        ask(bench, "c")
        assert "control is being handed over to B" in bench.refusals("c")[-1].why
        bench.handle(protocol.FromProgram(commands.Take("r1"), 1))
        assert bench.of(protocol.TakeReply)[-1].epoch is None

    @pytest.mark.parametrize("going", ["release", "lost"])
    def test_the_robot_is_free_if_the_new_operator_leaves_during_a_hand_over(
        self, bench, going
    ):
        ask(bench)
        grant(bench)
        if going == "release":
            bench.send("b", op="release", robot="r1")
        else:
            bench.handle(protocol.Disconnect("b"))
        bench.run(2.0)
        assert bench.report().state == "free"
        assert not bench.report().changing

    def test_stop_ends_a_hand_over(self, bench):
        ask(bench)
        grant(bench)
        bench.send("a", op="stop", robot="r1")
        bench.run(2.0)
        assert holder(bench) is None
        assert bench.refusals("b")[-1].why == "STOP by A"
        assert "STOP" in bench.report().reason

    def test_a_broken_link_ends_a_hand_over_with_a_reason(self, bench):
        ask(bench)
        grant(bench)
        bench.break_links()
        bench.run(0.1)
        assert "no connection" in bench.refusals("b")[-1].why
        assert not bench.report().changing

    def test_a_robot_without_a_velocity_topic_can_be_handed_over(self):
        bench = Bench().begin(spec(twist_topic=None))
        bench.take("a")
        ask(bench)
        grant(bench)
        bench.run(1.1)
        assert holder(bench) == "b"
        assert bench.did(actions.WriteTwist) == []

    def test_the_speed_limit_of_the_new_page_applies_after_a_hand_over(self, bench):
        ask(bench)
        grant(bench)
        bench.handle(protocol.Speeds("b", 0.2, 0.2))
        bench.run(1.1)
        assert bench.report().v == 0.2
